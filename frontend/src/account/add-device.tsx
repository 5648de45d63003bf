/** Add a device: a code for two minutes, and the question whether the device that sent it is one's own. */
import { Button, Group, Modal, Text } from "@mantine/core";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useState } from "react";
import { errorText } from "../api/http";
import {
  answerDevice,
  cancelDeviceCode,
  type DeviceCode,
  deviceCodeUrl,
  lookAtDevice,
  makeDeviceCode,
} from "../api/members";
import { pageUrl } from "../api/page-url";
import { isolated } from "../words/isolated";
import style from "./people-page.module.css";

const LOOK = 1_000; // ms between two looks whether a device has sent the code

interface Props {
  opened: boolean;
  onClose: () => void;
  /** The addresses of the page for other devices. */
  origins: readonly string[];
}

export function AddDevice({ opened, onClose, origins }: Props) {
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title="Add a device"
      size={420}
      centered
      closeButtonProps={{ "aria-label": "Close" }}
    >
      {opened && <Code origins={origins} onDone={onClose} />}
    </Modal>
  );
}

function Code({ origins, onDone }: { origins: readonly string[]; onDone: () => void }) {
  const [made, setMade] = useState<DeviceCode | null>(null);
  const [problem, setProblem] = useState("");
  const start = () => {
    setProblem("");
    setMade(null);
    makeDeviceCode().then(setMade, (error) => setProblem(errorText(error)));
  };
  useEffect(start, []);
  if (problem !== "") {
    return (
      <div className={style.asking} role="alert">
        <p>{problem}</p>
        <Button onClick={start}>New code</Button>
      </div>
    );
  }
  if (made === null) return <div className={style.waiting} aria-busy="true" />;
  return (
    <Waiting key={made.id} made={made} origins={origins} onDone={onDone} onOver={setProblem} />
  );
}

interface WaitingProps {
  made: DeviceCode;
  origins: readonly string[];
  onDone: () => void;
  onOver: (why: string) => void;
}

function Waiting({ made, origins, onDone, onOver }: WaitingProps) {
  const client = useQueryClient();
  const asked = useQuery({
    queryKey: ["device-code", made.id],
    queryFn: () => lookAtDevice(made.id),
    refetchInterval: LOOK,
    retry: false,
  });
  useEffect(() => {
    if (asked.isError) onOver(errorText(asked.error));
  }, [asked.isError, asked.error, onOver]);
  useEffect(() => () => void cancelDeviceCode(made.id).catch(() => {}), [made.id]);
  const say = (yes: boolean) =>
    answerDevice(made.id, yes).then(
      () => {
        void client.invalidateQueries({ queryKey: ["devices"] });
        if (yes) setTimeout(onDone, 2_000);
        else onDone();
      },
      (error) => onOver(errorText(error)),
    );
  const device = asked.data;
  if (device?.answered) return <p role="status">The device is signed in now.</p>;
  if (device?.browser) {
    return (
      <div className={style.asking} role="alert">
        <p>
          <b>{isolated(device.browser)}</b>
          {device.address && ` at ${device.address}`} wants to come in as you. Does it show{" "}
          <b className={style.number}>{device.number}</b>?
        </p>
        <Group gap="sm">
          <Button variant="filled" onClick={() => void say(true)}>
            Yes, it is mine
          </Button>
          <Button onClick={() => void say(false)}>No</Button>
        </Group>
      </div>
    );
  }
  const origin = origins[0] ?? pageUrl();
  return (
    <div className={style.code}>
      <Text size="sm">
        Scan this with the other device, or open <bdi>{origin}</bdi> there and type the code.
      </Text>
      <img
        src={deviceCodeUrl(made.id, origin)}
        alt="The code as a QR code"
        width={200}
        height={200}
      />
      <output className={style.digits} aria-label="Code">
        {made.code}
      </output>
      {origins.length === 0 && (
        <Text size="sm" c="dimmed">
          Only this computer reaches this server, so the code works only in another browser on it.
          For other devices, restart the server with <code>action-assistant serve --share</code>.
        </Text>
      )}
      <Text size="sm" c="dimmed">
        It works once, within two minutes. Then you confirm the device here.
      </Text>
    </div>
  );
}
