/** Keeps a run as an incident: it is never archived, and one file of all that is known is downloaded. */
import { Button, Modal, Stack, Text, TextInput } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { editor } from "../api/client";
import { errorText, fetchAnswer } from "../api/http";
import type { Run } from "../api/runs";
import type { EditorApi } from "../api/schema/editor";
import { runnerOfRun } from "../api/site-places";
import { serverNow } from "../clock/server-clock";
import { instant } from "../ui/times";

interface Props {
  runner: string;
  run: Run;
  onClose: () => void;
}

export function IncidentDialog({ runner, run, onClose }: Props) {
  const [reason, setReason] = useState("");
  const keep = useMutation({
    mutationFn: async () =>
      saveFile(await keepIncident(runner, run, reason), `incident-${run.number}.zip`),
    onSuccess: onClose,
  });
  return (
    <Modal opened onClose={onClose} title={`Keep run ${run.number} as an incident`} centered>
      <Stack gap="sm">
        <Text size="sm" c="dimmed">
          The run is never archived from now on. One file is downloaded: all events of the run and
          its parts with the check of their chain, the graph as it was sent, what was recorded of
          the robots, who did what at that time, and the versions of the software.
        </Text>
        <TextInput
          label="Why it is kept"
          value={reason}
          maxLength={1000}
          onChange={(event) => setReason(event.currentTarget.value)}
          data-autofocus
        />
        {keep.isError && (
          <Text size="sm" c="red" role="alert">
            {errorText(keep.error)}
          </Text>
        )}
        <Button loading={keep.isPending} onClick={() => keep.mutate()}>
          Keep and download
        </Button>
      </Stack>
    </Modal>
  );
}

const AROUND_MS = 3_600_000;
const PAGES = 10; // of the editor's audit

/** Keep a run, and return its file. The runner has no access to the editor's audit: it goes along, and
 * the editor is told to keep it. */
async function keepIncident(runner: string, run: Run, reason: string): Promise<Blob> {
  const url = `${runnerOfRun(runner, run.id)}/api/runs/${encodeURIComponent(run.id)}/incident`;
  const body = { reason, editor_audit: await editorAudit(run) };
  const answer = await fetchAnswer(url, { method: "POST", body, timeoutMs: 120_000 });
  return answer.blob();
}

async function editorAudit(run: Run): Promise<readonly EditorApi["AuditRow"][]> {
  const since = new Date((instant(run.requested_at) ?? 0) - AROUND_MS).toISOString();
  const until = new Date((instant(run.ended_at) ?? serverNow()) + AROUND_MS).toISOString();
  const rows: EditorApi["AuditRow"][] = [];
  let before: number | undefined;
  try {
    await editor.post("/api/audit/kept", { body: { run: run.id, since, until } });
  } catch {
    // An editor of an earlier version keeps everything.
  }
  try {
    for (let page = 0; page < PAGES; page += 1) {
      const query = { since, until, before, limit: 500 };
      const found: EditorApi["AuditPage"] = await editor.get("/api/audit", { query });
      rows.push(...found.rows);
      if (found.before === null) break;
      before = found.before;
    }
  } catch {
    // Without the editor the file lacks its part, as a file made by the runner alone does.
  }
  return rows;
}

function saveFile(file: Blob, name: string): void {
  const url = URL.createObjectURL(file);
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}
