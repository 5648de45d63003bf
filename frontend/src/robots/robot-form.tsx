/** Registers a robot, or changes how it is reached. */

import {
  Button,
  Collapse,
  Group,
  Modal,
  NumberInput,
  Stack,
  Switch,
  Text,
  TextInput,
} from "@mantine/core";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { errorText, Refusal } from "../api/http";
import { useLive } from "../api/page-link";
import { changeRobot, type Registration, registerRobot } from "../api/robots";
import { useSiteChoice } from "../status/site-choice";
import { usePendingText } from "../ui/drafts";
import { isolated } from "../words/isolated";

type RobotFormField = "name" | "domain" | "get_service" | "rmw" | "profile";

/** The field that a refusal points at; "" when it is about all of it. */
function refusedField(error: unknown): RobotFormField | "" {
  const path = error instanceof Refusal ? (error.details.where?.path ?? "") : "";
  const found = /^\/(name|domain|get_service|rmw|profile)\b/.exec(path)?.[1];
  return (found as RobotFormField | undefined) ?? "";
}

function Profile(props: {
  profile: Registration["profile"];
  error: string | undefined;
  onChange: (profile: Registration["profile"]) => void;
}) {
  const { profile, error, onChange } = props;
  const put = (key: string, value: unknown) => {
    const { [key]: _, ...others } = profile;
    onChange(value === "" || value === false ? others : { ...others, [key]: value });
  };
  const is = (key: string) => profile[key] === true;
  return (
    <Stack gap="sm">
      <TextInput
        label="Commit of its engine"
        placeholder="5819055"
        value={typeof profile.commit === "string" ? profile.commit : ""}
        error={error}
        onChange={(event) => put("commit", event.currentTarget.value.trim())}
      />
      <Switch
        label="Its engine can stop a graph that is paused (otherwise Pause is not offered)"
        checked={is("pauses_safely")}
        onChange={(event) => put("pauses_safely", event.currentTarget.checked)}
      />
      <Switch
        label="Its engine synchronises with others (graphs of several robots)"
        checked={is("synchronises")}
        onChange={(event) => put("synchronises", event.currentTarget.checked)}
      />
      <Switch
        label="Bypassing an action works there (H3 is fixed)"
        checked={is("bypass_fixed")}
        onChange={(event) => put("bypass_fixed", event.currentTarget.checked)}
      />
      <Switch
        label="Each start, and each change of a run there, needs the yes of a second person"
        checked={is("second_person")}
        onChange={(event) => put("second_person", event.currentTarget.checked)}
      />
    </Stack>
  );
}

interface ReachProps {
  robot: Registration;
  errorOf: (field: RobotFormField) => string | undefined;
  onChange: (robot: Registration) => void;
}

/** Fields for the domain and topics of the engine of a robot, with what is known of them. */
function Reach({ robot, errorOf, onChange }: ReachProps) {
  return (
    <Stack gap="md">
      <TextInput
        label="Path of its get service"
        description="Two engines on one path prove nothing: give each a domain of its own."
        value={robot.get_service}
        error={errorOf("get_service")}
        onChange={(event) => onChange({ ...robot, get_service: event.currentTarget.value.trim() })}
      />
      <TextInput
        label="Middleware"
        placeholder="that of the runner"
        value={robot.rmw}
        error={errorOf("rmw")}
        onChange={(event) => onChange({ ...robot, rmw: event.currentTarget.value.trim() })}
      />
      <Profile
        profile={robot.profile}
        error={errorOf("profile")}
        onChange={(profile) => onChange({ ...robot, profile })}
      />
    </Stack>
  );
}

/** A registration in its form; `isNew`: the robot is not registered yet. `at`: the runner that has found its engine. */
export interface EditedRobot {
  robot: Registration;
  isNew: boolean;
  at?: string | undefined;
}

export function RobotForm({ editing, onClose }: { editing: EditedRobot; onClose: () => void }) {
  const { runner: anywhere } = useLive();
  const { runner, choice } = useSiteChoice(editing.at);
  const client = useQueryClient();
  const [robot, setRobot] = useState(editing.robot);
  usePendingText(robot === editing.robot ? "" : JSON.stringify(robot), null);
  const [more, setMore] = useState(!editing.isNew);
  const [error, setError] = useState<unknown>(null);
  const [busy, setBusy] = useState(false);
  const place = refusedField(error);
  const at = (field: RobotFormField) => (place === field ? errorText(error) : undefined);
  const save = async () => {
    setBusy(true);
    try {
      if (editing.isNew) await registerRobot(runner ?? "", robot);
      else await changeRobot(anywhere ?? "", robot);
      await client.invalidateQueries({ queryKey: ["robots"] });
      onClose();
    } catch (problem) {
      setError(problem);
      setBusy(false);
      if (refusedField(problem) !== "" && refusedField(problem) !== "name") setMore(true);
    }
  };
  const title = editing.isNew ? "Register a robot" : `Change ${isolated(editing.robot.name)}`;
  return (
    <Modal opened onClose={onClose} title={title} closeButtonProps={{ "aria-label": "Close" }}>
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void save();
        }}
      >
        <Stack gap="md">
          <TextInput
            label="Name"
            description="The name with which its engine was started (--actor-name). Small and capital letters count."
            value={robot.name}
            disabled={!editing.isNew}
            error={at("name")}
            maxLength={64}
            data-autofocus
            onChange={(event) => setRobot({ ...robot, name: event.currentTarget.value.trim() })}
          />
          {editing.isNew && choice}
          <NumberInput
            label="ROS domain"
            description="ROS_DOMAIN_ID of the engine; 0 unless somebody set it."
            value={robot.domain}
            min={0}
            max={232}
            allowDecimal={false}
            error={at("domain")}
            onChange={(value) => setRobot({ ...robot, domain: Number(value) || 0 })}
          />
          <Switch
            label="Runs that are led step by step"
            description="Such a run may start further actions on this robot, minutes later, until it ends."
            checked={robot.led}
            onChange={(event) => setRobot({ ...robot, led: event.currentTarget.checked })}
          />
          <Button
            variant="subtle"
            size="compact-sm"
            w="fit-content"
            aria-expanded={more}
            onClick={() => setMore(!more)}
          >
            {more ? "Less" : "Path, middleware and engine …"}
          </Button>
          <Collapse expanded={more}>
            <Reach robot={robot} errorOf={at} onChange={setRobot} />
          </Collapse>
          {error !== null && place === "" && (
            <Text c="var(--error)" role="alert">
              {errorText(error)}
            </Text>
          )}
          <Group justify="flex-end">
            <Button onClick={onClose}>Cancel</Button>
            <Button type="submit" variant="filled" loading={busy} disabled={robot.name === ""}>
              {editing.isNew ? "Register" : "Save"}
            </Button>
          </Group>
        </Stack>
      </form>
    </Modal>
  );
}
