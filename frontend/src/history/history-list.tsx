/**
 * History of a document, newest first: who changed what and when, and a button to restore each
 * moment.
 */
import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconRestore } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { authorName } from "../api/graphs";
import {
  type HistoryEntry,
  refreshHistory,
  restoreMoment,
  useDifference,
  useHistory,
} from "../api/history";
import { errorText } from "../api/http";
import { DifferenceView, meansSomething } from "../differences/difference-view";
import { clock, day, instant, useNow } from "../ui/times";
import style from "./history-list.module.css";
import { doneWords, isWayBack, momentBefore } from "./history-words";

interface Props {
  id: string;
  /** The moment on screen; what comes after it is read with it. */
  seq: number;
  mayEdit: boolean;
}

function Changed({ id, from, to }: { id: string; from: number; to: number }) {
  const found = useDifference(id, from, to);
  if (found.isPending) return <Skeleton height={24} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  if (!meansSomething(found.data)) return <p className="m-0 ink3">Only where things stand.</p>;
  return <DifferenceView found={found.data} label="What it changed" />;
}

interface EntryProps extends Props {
  entry: HistoryEntry;
  now: number;
}

function Row({ entry, id, seq, mayEdit, now }: EntryProps) {
  const client = useQueryClient();
  const [open, setOpen] = useState(false);
  const at = instant(entry.until);
  const before = momentBefore(entry);
  const when = at === null ? "" : `${day(at, now)} ${clock(at)}`;
  const goBack = useMutation({
    mutationFn: () => restoreMoment(id, entry.seq),
    onError: (error) =>
      notifications.show({ color: "red", title: "Not restored", message: errorText(error) }),
    onSettled: () => refreshHistory(client, id),
  });
  return (
    <li className={style.entry}>
      <p className="m-0 flex justify-between gap-75">
        <span>
          <bdi className="weight-600">{authorName(entry.author)}</bdi> {doneWords(entry)}
        </span>
        <time className="flex-none faint-12 tabular" dateTime={entry.until}>
          {when}
        </time>
      </p>
      <div className={`${style.buttons} fingers`}>
        {before !== null && (
          <Button
            size="compact-sm"
            variant="subtle"
            aria-expanded={open}
            onClick={() => setOpen(!open)}
          >
            What changed
          </Button>
        )}
        {mayEdit && isWayBack(entry, seq) && (
          <Button
            size="compact-sm"
            variant="subtle"
            loading={goBack.isPending}
            leftSection={<IconRestore size={14} aria-hidden />}
            onClick={() => goBack.mutate()}
          >
            Restore<span className="visually-hidden"> it as on {when}</span>
          </Button>
        )}
      </div>
      {open && before !== null && <Changed id={id} from={before} to={entry.seq} />}
    </li>
  );
}

export function HistoryList(props: Props) {
  const now = useNow(60_000);
  const history = useHistory(props.id, props.seq);
  if (history.isPending) return <Skeleton height={120} />;
  if (history.isError) return <p role="alert">{errorText(history.error)}</p>;
  return (
    <ol className="list-reset" aria-label="History">
      {history.data.map((entry) => (
        <Row key={`${entry.kind} ${entry.seq} ${entry.at}`} entry={entry} now={now} {...props} />
      ))}
    </ol>
  );
}
