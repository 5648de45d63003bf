/** Asks the person to confirm who they are, by another device, where something was refused for that. */
import { Button, Group, Modal, Text } from "@mantine/core";
import { IconDevices, IconKey } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { bringConfirmation, confirmByDevice } from "../api/confirmations";
import { errorText, unconfirmed } from "../api/http";
import { useLive } from "../api/page-link";
import { confirmByPasskey, offersPasskeys, usePasskeys } from "../api/passkeys";
import { useStableCallback } from "../ui/hooks";
import { useWatched } from "../ui/watched";
import { isolated } from "../words/isolated";
import style from "./people-page.module.css";
import { ProofLink } from "./provider-sign-in";

export function ConfirmDialog() {
  const robots = useWatched(unconfirmed);
  const close = () => unconfirmed.set(null);
  return (
    <Modal
      opened={robots !== null}
      onClose={close}
      title="Confirm that it is you"
      size={420}
      centered
      closeButtonProps={{ "aria-label": "Close" }}
      zIndex={310}
    >
      {robots !== null && <Means robots={robots} onDone={close} />}
    </Modal>
  );
}

interface Waiting {
  readonly number: string;
  readonly devices: number;
}

/** Calls `onConfirmed` when this session was confirmed in another tab meanwhile, such as by signing in
 * again: looked at when the person comes back to this one. */
function useElsewhere(onConfirmed: () => void) {
  const { runner = "" } = useLive();
  const known = useRef<string | null>(null);
  const look = useStableCallback(async () => {
    const seal = await bringConfirmation(runner).catch(() => null);
    if (seal === null) return;
    if (known.current !== null && seal !== known.current) onConfirmed();
    known.current = seal;
  });
  useEffect(() => {
    void look();
    window.addEventListener("focus", look);
    return () => window.removeEventListener("focus", look);
  }, [look]);
}

const SHOWN = 1_500; // ms for which the page says that it has worked

function Means({ robots, onDone }: { robots: readonly string[]; onDone: () => void }) {
  const { runner } = useLive();
  const client = useQueryClient();
  const [waiting, setWaiting] = useState<Waiting | null>(null);
  const [problem, setProblem] = useState("");
  const [confirmed, setConfirmed] = useState(false);
  const hasPasskeys = (usePasskeys().data?.passkeys.length ?? 0) > 0 && offersPasskeys();
  const asking = useRef<AbortController | null>(null);
  useEffect(() => () => asking.current?.abort(), []);
  useElsewhere(() => finish());
  const finish = () => {
    setConfirmed(true);
    void client.invalidateQueries({ queryKey: ["preflight"] });
  };
  const close = useStableCallback(onDone);
  useEffect(() => {
    if (!confirmed) return;
    const timer = setTimeout(close, SHOWN);
    return () => clearTimeout(timer);
  }, [confirmed, close]);
  const ask = async () => {
    const stop = new AbortController();
    asking.current = stop;
    setProblem("");
    try {
      const yes = await confirmByDevice(runner ?? "", robots, setWaiting, stop.signal);
      if (yes) finish();
      else setProblem("Your other device has said that it was not you.");
    } catch (error) {
      if (!stop.signal.aborted) setProblem(errorText(error));
    }
    setWaiting(null);
  };
  const show = async () => {
    setProblem("");
    try {
      await confirmByPasskey(runner ?? "");
      finish();
    } catch (error) {
      setProblem(errorText(error));
    }
  };
  if (confirmed) return <p role="status">Confirmed. Now do again what you wanted to do.</p>;
  if (waiting !== null) {
    return (
      <div className={style.asking} role="status">
        <p>
          Your other devices show <b className={style.number}>{waiting.number}</b>. Say <i>yes</i>{" "}
          on one of them.
        </p>
        {waiting.devices === 0 && (
          <p className="m-0 ink-warn text-13">
            No other device of yours has this page open now. Open it on one, within two minutes.
          </p>
        )}
        <Button onClick={() => asking.current?.abort()}>Cancel</Button>
      </div>
    );
  }
  const where = robots.map(isolated).join(", ");
  return (
    <div className={style.asking}>
      <p>
        {where === ""
          ? "It is some time ago that you confirmed who you are."
          : `Before a start on ${where} you confirm who you are.`}
      </p>
      {problem !== "" && (
        <p className="m-0 ink-error text-13" role="alert">
          {problem}
        </p>
      )}
      <Group gap="sm">
        {hasPasskeys && (
          <Button
            variant="filled"
            leftSection={<IconKey size={15} aria-hidden />}
            onClick={() => void show()}
          >
            With a passkey
          </Button>
        )}
        <Button
          variant={hasPasskeys ? "default" : "filled"}
          leftSection={<IconDevices size={15} aria-hidden />}
          onClick={() => void ask()}
        >
          On another device
        </Button>
      </Group>
      <ProofLink />
      <Text size="xs" c="dimmed">
        Stop never asks for this. A device that you add now can confirm from tomorrow on.
      </Text>
    </div>
  );
}
