/** What was stored of a run, event by event, as it stands in the journal: messages as received. */
import { Button } from "@mantine/core";
import { IconDownload, IconRefresh } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../../api/http";
import { exportUrl, useRawEvents } from "../../api/review";
import type { Run } from "../../api/runs";
import style from "./raw-events.module.css";

interface Stored {
  seq: number;
  kind: string;
  body: unknown;
}

function stored(line: string): Stored | null {
  try {
    const event: unknown = JSON.parse(line);
    if (typeof event !== "object" || event === null) return null;
    if (!("seq" in event && "kind" in event)) return null;
    const body = "body" in event ? event.body : event;
    return { seq: Number(event.seq), kind: String(event.kind), body };
  } catch {
    return null;
  }
}

function Event({ line }: { line: string }) {
  const [open, setOpen] = useState(false);
  const event = stored(line);
  return (
    <details className={style.event} onToggle={(each) => setOpen(each.currentTarget.open)}>
      <summary>
        <span className={style.seq}>{event?.seq ?? ""}</span> {event?.kind ?? line.slice(0, 60)}
      </summary>
      {open && <pre>{event === null ? line : JSON.stringify(event.body, null, 1)}</pre>}
    </details>
  );
}

const MOST = 300;

export function RawEvents({ runner, run }: { runner: string | undefined; run: Run }) {
  const found = useRawEvents(runner, run, MOST);
  return (
    <div className={style.raw}>
      <div className={style.buttons}>
        <Button
          size="compact-xs"
          variant="default"
          leftSection={<IconRefresh size={13} aria-hidden />}
          loading={found.isFetching}
          onClick={() => void found.refetch()}
        >
          Read again
        </Button>
        {runner !== undefined && (
          <Button
            size="compact-xs"
            variant="default"
            component="a"
            href={exportUrl(runner, run.id, "jsonl")}
            leftSection={<IconDownload size={13} aria-hidden />}
          >
            All as a file
          </Button>
        )}
      </div>
      {found.isError && <p role="alert">{errorText(found.error)}</p>}
      {found.data?.lines.map((line) => (
        <Event key={line} line={line} />
      ))}
      {found.data?.more && <p>These are the first {MOST}; the file has all of them.</p>}
    </div>
  );
}
