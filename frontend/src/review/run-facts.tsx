/** Facts, notes and labels of a run. */

import { ActionIcon, Button, TagsInput, Textarea } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconPin, IconPinFilled } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { Link } from "wouter";
import { useVersions, versionName } from "../api/graphs";
import { errorText } from "../api/http";
import { actorWords } from "../api/people";
import { type RunMarks, setMarks, useLabels, useMarks, useRaw } from "../api/review";
import { limitWords, pageWords } from "../api/rights";
import { type Run, requesterPlace, runPlace } from "../api/runs";
import { boundsText } from "../status/durations";
import { fromWords } from "../status/earlier-list";
import { spokenIn } from "../status/level-places";
import { runEndText } from "../status/progress";
import { valuesWords } from "../status/value-words";
import { useDraft } from "../ui/drafts";
import { clock, day, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./run-facts.module.css";
import { recordedUrls, useRunLinks } from "./run-links";

type Rest = NonNullable<Run["at_rest"]>;

interface Props {
  runner: string | undefined;
  run: Run;
  version: string;
  by: string;
  /** The moment that is shown, ms; null for the end, or now. */
  at: number | null;
}

function restWords(rest: Rest, moment: (at: number | null) => string): string {
  const who = rest.by
    ? `by ${actorWords(rest.by, isolated(rest.by.name))}${requesterPlace(rest.by)}`
    : "by the runner";
  return `${moment(instant(rest.at))} ${who}: “${rest.how}”`;
}

/** Links to recordings by other programs, such as videos, of each robot at the moment that is shown. */
function Recorded({ run, at }: Pick<Props, "run" | "at">) {
  const links = useRunLinks();
  const addresses = links.flatMap(({ name, url }) =>
    recordedUrls(run, url, at).map(({ robot, href }) => ({ name, robot, href })),
  );
  if (addresses.length === 0) return null;
  return (
    <div>
      <dt className="ink2">Kept elsewhere</dt>
      <dd className="row-wrap gap-50">
        {addresses.map(({ name, robot, href }) => (
          <a
            className="ink-accent"
            key={`${name} ${robot}`}
            href={href}
            target="_blank"
            rel="noopener noreferrer"
          >
            {name}
            {run.robots ? ` of ${isolated(robot)}` : ""}
          </a>
        ))}
      </dd>
    </div>
  );
}

export function RunFacts({ runner, run, version, by, at }: Props) {
  const raw = useRaw(runner, run).data;
  const now = useNow(60_000);
  const start = instant(run.started_at);
  const end = instant(run.ended_at);
  const moment = (at: number | null) => (at === null ? "—" : `${day(at, now)} ${clock(at)}`);
  const rows: [string, string][] = [
    ["Graph", run.graph_name],
    ["Version", version],
    ["Digest", run.digest],
    ...(run.from ? [["Began", fromWords(run.from)] as [string, string]] : []),
    ...(run.values ? [["Started with", valuesWords(run.values)] as [string, string]] : []),
    ...(run.sent_digest ? [["Digest with that", run.sent_digest] as [string, string]] : []),
    ...Object.entries(run.limits ?? {}).map(([robot, limits]): [string, string] => [
      "Limits",
      `${isolated(robot)}: ${limits.map(limitWords).join(", ")}`,
    ]),
    ...Object.entries(run.pages ?? {}).map(([robot, page]): [string, string] => [
      "Visible page",
      `${isolated(robot)}: ${pageWords(page)}`,
    ]),
    ...Object.entries(run.health ?? {}).map(([robot, said]): [string, string] => [
      `Health of ${isolated(robot)}`,
      said.join(" "),
    ]),
    ...(run.repeat ? [["Repeat", `its run ${run.repeat.cell}`] as [string, string]] : []),
    ["Engine", runPlace(run)],
    ["Started by", `${by}${requesterPlace(run.author)}`],
    ...(run.batons
      ? [["Baton", `${by} held that of ${run.batons.map(isolated).join(", ")}`] as [string, string]]
      : []),
    ...(run.watching
      ? [
          [
            "Watched",
            `${by} said to watch ${run.watching.map(isolated).join(", ")}, with the hardware stop within reach`,
          ] as [string, string],
        ]
      : []),
    ...(run.lead
      ? [["Led on for", `${run.lead.name}${requesterPlace(run.lead)}`] as [string, string]]
      : []),
    ["Started", moment(start)],
    ...(run.stopped_by
      ? [
          [
            "Stopped by",
            `${actorWords(run.stopped_by, run.stopped_by.name)}${requesterPlace(run.stopped_by)}`,
          ] as [string, string],
        ]
      : []),
    ["End known", moment(end)],
    ["Took", (end !== null && boundsText(run.took)) || "—"],
    ["End", end === null ? "goes on" : runEndText(run)],
    ["Result", run.result?.replace(/^on_/, "") ?? "—"],
    ["Why", spokenIn(run, run.detail) || "—"],
    ["Recorded", run.recorded ? "all of it" : "NOT all of it: the journal could not be written"],
    ...(run.archived
      ? [
          ["Archived", `${moment(instant(run.archived.at))}, ${run.archived.file}`] as [
            string,
            string,
          ],
        ]
      : []),
    ...(raw
      ? [["Raw messages", raw.text || `here, ${raw.hours.length} h`] as [string, string]]
      : []),
    ["Last proof", moment(instant(run.proof_at))],
    ...(run.at_rest ? [["Seen at rest", restWords(run.at_rest, moment)] as [string, string]] : []),
    ...(run.despite ?? []).map(({ code, text }): [string, string] => ["In spite of", text ?? code]),
    ...(run.override ? [["Because", `“${run.override.reason}”`] as [string, string]] : []),
  ];
  return (
    <dl className={style.facts}>
      <Recorded run={run} at={at} />
      {rows.map(([name, value]) => (
        <div key={`${name} ${value}`}>
          <dt className="ink2">{name}</dt>
          <dd className={name.startsWith("Digest") ? "text-11_5 mono" : undefined}>
            {name === "Repeat" && run.repeat ? (
              <Link to={`/runs/repeats/${run.repeat.id}`}>{value}</Link>
            ) : (
              value
            )}
          </dd>
        </div>
      ))}
    </dl>
  );
}

/** The marks of a run and a way to change them, shown at once and taken back if refused. */
function useEditedMarks(runner: string | undefined, run: string) {
  const client = useQueryClient();
  const marks = useMarks(runner, run);
  const change = async (part: Partial<RunMarks>): Promise<void> => {
    if (runner === undefined) return;
    const key = ["runs", "marks", run];
    const before = client.getQueryData<RunMarks>(key);
    if (before) client.setQueryData(key, { ...before, ...part });
    try {
      client.setQueryData(key, await setMarks(runner, run, part));
      void client.invalidateQueries({ queryKey: ["runs", "list"] });
      void client.invalidateQueries({ queryKey: ["runs", "labels"] });
    } catch (error) {
      client.setQueryData(key, before);
      notifications.show({ color: "red", title: "Not noted", message: errorText(error) });
    }
  };
  return { marks: marks.data, change };
}

export function PinRun({ runner, run }: { runner: string | undefined; run: string }) {
  const { marks, change } = useEditedMarks(runner, run);
  const pinned = marks?.pinned ?? false;
  return (
    <ActionIcon
      aria-label={pinned ? "Unpin this run" : "Pin this run"}
      aria-pressed={pinned}
      disabled={marks === undefined}
      onClick={() => void change({ pinned: !pinned })}
    >
      {pinned ? <IconPinFilled size={16} aria-hidden /> : <IconPin size={16} aria-hidden />}
    </ActionIcon>
  );
}

export function RunNotes({ runner, run }: { runner: string | undefined; run: string }) {
  const { marks, change } = useEditedMarks(runner, run);
  const known = useLabels(runner).data ?? [];
  const saved = marks?.note ?? "";
  const field = useDraft({
    value: saved,
    onCommit(note) {
      void change({ note });
      return true;
    },
    onLeaving: true,
  });
  return (
    <section className={style.notes} aria-label="Notes">
      <TagsInput
        label="Labels"
        placeholder={marks?.labels.length ? "" : "For example “demo”"}
        data={known}
        maxTags={20}
        maxLength={60}
        clearable
        disabled={marks === undefined}
        value={marks?.labels ?? []}
        onChange={(labels) => void change({ labels: labels.map((each) => each.trim()) })}
      />
      <Textarea
        label="Note"
        placeholder="What should the next person know about this run?"
        autosize
        minRows={2}
        maxLength={4000}
        disabled={marks === undefined}
        value={field.text}
        onChange={(event) => field.change(event.currentTarget.value)}
        onBlur={field.leave}
      />
      {field.text !== saved && (
        <Button size="compact-sm" onClick={field.leave}>
          Save note
        </Button>
      )}
    </section>
  );
}

export function useVersionLabel(run: Run): string {
  const versions = useVersions(run.graph ?? "", run.version).data;
  return versionName(versions, run.version) || run.digest.slice(0, 7);
}
