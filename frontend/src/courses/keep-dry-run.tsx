/** Makes a dry-run an expected course: with the decisions made in it. */
import { Button, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconShieldCheck } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { expectDryRun, refreshCourses } from "../api/courses";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { commandsOf, scriptOf } from "../dry-run/script";
import type { DryRun } from "../dry-run/use-dry-run";
import { useEditorContext } from "../edit-actions/editor-context";
import { useThrottledLink } from "../sync/use-room";
import { isolated } from "../words/isolated";
import style from "./courses.module.css";

/** Return why a dry-run cannot become an expected course; null if it can. */
function obstacleOf(run: DryRun): string | null {
  if (run.moments.length === 0) return "nothing happens in it";
  if (commandsOf(run.decided).length > 0) return "somebody presses Stop in this dry-run";
  const given = Object.keys(run.given?.values ?? {}).length > 0;
  return given ? "values were given in this dry-run, and an expected course has none" : null;
}

export function KeepDryRun({ run }: { run: DryRun }) {
  const { id, graph, mayEdit, setPanel } = useEditorContext();
  const { runner } = useLive();
  const { seq, unsaved } = useThrottledLink();
  const client = useQueryClient();
  const [naming, setNaming] = useState(false);
  if (!mayEdit || runner === undefined) return null;
  const obstacle = obstacleOf(run);
  const keep = async (name: string) => {
    await expectDryRun(runner, { graph: id, seq, script: scriptOf(run.decided) }, name);
    await refreshCourses(client);
    setPanel("courses");
    notifications.show({
      title: "Expected from now on",
      message: `Every later version of the graph is checked against “${isolated(name)}”.`,
    });
  };
  if (naming) {
    return (
      <NameField
        proposed={`${graph.name || "Untitled"} goes so`.slice(0, 100)}
        onKeep={keep}
        onClose={() => setNaming(false)}
      />
    );
  }
  return (
    <Button
      size="compact-sm"
      variant="default"
      leftSection={<IconShieldCheck size={14} aria-hidden />}
      disabled={obstacle !== null || unsaved > 0}
      title={obstacle ?? undefined}
      onClick={() => setNaming(true)}
    >
      Expect this course …
    </Button>
  );
}

interface NameFieldProps {
  proposed: string;
  onKeep: (name: string) => Promise<unknown>;
  onClose: () => void;
}

export function NameField({ proposed, onKeep, onClose }: NameFieldProps) {
  const [name, setName] = useState(proposed);
  const [busy, setBusy] = useState(false);
  const [refused, setRefused] = useState("");
  const keep = async () => {
    setBusy(true);
    try {
      await onKeep(name);
      onClose();
    } catch (error) {
      setRefused(errorText(error));
    } finally {
      setBusy(false);
    }
  };
  return (
    <form
      className={style.naming}
      onSubmit={(event) => {
        event.preventDefault();
        void keep();
      }}
    >
      <TextInput
        size="xs"
        aria-label="Name of the expected course"
        value={name}
        maxLength={100}
        error={refused || undefined}
        data-autofocus
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Button size="compact-sm" type="submit" loading={busy} disabled={name.trim() === ""}>
        Expect this
      </Button>
      <Button size="compact-sm" variant="subtle" onClick={onClose}>
        Cancel
      </Button>
    </form>
  );
}
