/** One version: its name, note, author and digest, its runs, and what can be done with it. */
import { ActionIcon, Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconCopy,
  IconCopyPlus,
  IconGitCompare,
  IconLink,
  IconRestore,
  IconRosetteDiscountCheck,
} from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link } from "wouter";
import { renewing } from "../api/client";
import {
  authorName,
  fetchVersion,
  type PinnedGraph,
  queryKeys,
  setReleased,
  type Version,
} from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import type { ListedRun } from "../api/review";
import type { Tone } from "../status/progress";
import { type Heard, runStatus, useRunStatus } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { day, hourMinute, instant } from "../ui/times";
import { Tooltip } from "../ui/tooltip";
import { counted } from "../words/counted";
import { copied } from "./restoring";
import style from "./versions.module.css";

const NEWEST = 3; // runs that are named

const timeWords = (text: string | null, now: number): string => {
  const at = instant(text);
  return at === null ? "" : `${day(at, now)} ${hourMinute(at)}`;
};

function RunItem({ run, now }: { run: ListedRun; now: number }) {
  const { tone, word } = useRunStatus(run);
  const at = run.started_at ?? run.requested_at;
  return (
    <li>
      <Link to={`/runs/${run.id}`}>
        <StateLabel still tone={tone} word={`Run ${run.number}`} />
        <span>{word}</span>
        <time dateTime={at}>{timeWords(at, now)}</time>
      </Link>
    </li>
  );
}

function Runs({ runs, now }: { runs: readonly ListedRun[]; now: number }) {
  const { now: heard } = useLive();
  if (runs.length === 0) return <p className={style.quiet}>{runsWords(runs, heard)}</p>;
  return (
    <>
      {runs.length > 1 && (
        <p className={style.counts}>
          <span className="visually-hidden">{runsWords(runs, heard)}</span>
          <span aria-hidden>
            {runs.length} runs:{" "}
            {resultCounts(runs, heard).map(({ tone, word, count }) => (
              <StateLabel key={word} still tone={tone} word={`${count} ${word}`} />
            ))}
          </span>
        </p>
      )}
      <ul className={style.runs} aria-label="Newest runs">
        {runs.slice(0, NEWEST).map((run) => (
          <RunItem key={run.id} run={run} now={now} />
        ))}
      </ul>
    </>
  );
}

interface Props {
  listed: ListedVersion;
  now: number;
  chosen: boolean;
  /** Set for the present graph, which cannot be compared with itself or restored. */
  isNow: boolean;
  link: string;
  mayEdit: boolean;
  busy: boolean;
  onChoose: () => void;
  onCompare: () => void;
  onCopy: () => void;
  onRestore: () => void;
}

function Ways(props: Props) {
  const { listed, isNow, mayEdit, busy, link, onCompare, onCopy, onRestore } = props;
  const button = { size: "compact-sm", variant: "default" } as const;
  return (
    <div className={`${style.ways} fingers`}>
      {!isNow && (
        <Button
          {...button}
          leftSection={<IconGitCompare size={14} aria-hidden />}
          onClick={onCompare}
        >
          Compare with now
        </Button>
      )}
      <Button
        {...button}
        leftSection={<IconLink size={14} aria-hidden />}
        onClick={() => void copied(link, "The link")}
      >
        <span>
          <span className="visually-hidden">Copy </span>Link
        </span>
      </Button>
      {mayEdit && (
        <Button
          {...button}
          loading={busy}
          leftSection={<IconCopyPlus size={14} aria-hidden />}
          onClick={onCopy}
        >
          Copy {listed.number} as a new graph
        </Button>
      )}
      {mayEdit && !isNow && (
        <Button
          {...button}
          loading={busy}
          leftSection={<IconRestore size={14} aria-hidden />}
          onClick={onRestore}
        >
          Restore {listed.number}
        </Button>
      )}
      <ReleaseButton version={listed.version} number={listed.number} />
    </div>
  );
}

/** Return what the button of a release does. `again`: the last try failed. */
function releaseWords(number: string, releases: boolean, again: boolean): string {
  if (releases) return again ? `Release ${number} again` : `Release ${number}`;
  return `Withdraw the release of ${number}${again ? " again" : ""}`;
}

/** Lets an owner release a version: robots whose owners demand that start no other. */
function ReleaseButton({ version, number }: { version: Version; number: string }) {
  const { runner } = useLive();
  const client = useQueryClient();
  const isOwner = useMay("share");
  const { graph, released } = version;
  // What has failed may be done at the editor alone: it is offered again, whatever the editor shows now.
  const [failed, setFailed] = useState<boolean | null>(null);
  const releases = failed ?? released === undefined;
  const change = useMutation({
    mutationFn: () => setReleased(runner, version, releases),
    onSuccess: () => setFailed(null),
    onError: (error) => {
      setFailed(releases);
      notifications.show({
        color: "red",
        autoClose: false,
        title: `${number} may not be ${releases ? "released" : "withdrawn"} everywhere: try again`,
        message: errorText(error),
      });
    },
    onSettled: renewing(() => client.invalidateQueries({ queryKey: queryKeys.versions(graph) })),
  });
  if (!isOwner) return null;
  return (
    <Button
      size="compact-sm"
      variant="default"
      loading={change.isPending}
      leftSection={<IconRosetteDiscountCheck size={14} aria-hidden />}
      onClick={() => change.mutate()}
    >
      {releaseWords(number, releases, failed !== null)}
    </Button>
  );
}

export function VersionItem(props: Props) {
  const { listed, now, chosen, onChoose } = props;
  const { version, number, runs } = listed;
  const { label, note, digest, author, at, released } = version;
  return (
    <li className={style.version} data-chosen={chosen || undefined} data-version={number}>
      <button
        type="button"
        className={`${style.choose} finger`}
        aria-pressed={chosen}
        onClick={onChoose}
      >
        <b className={style.number}>{number}</b>
        {label !== "" && <bdi className={style.label}>{label}</bdi>}
      </button>
      {note && (
        <p className={style.note} dir="auto">
          {note}
        </p>
      )}
      <p className={style.facts}>
        <bdi className="ink">{authorName(author)}</bdi> ·{" "}
        <time dateTime={at}>{timeWords(at, now)}</time> ·{" "}
        <code title={digest}>{shortDigest(digest)}</code>
        <Tooltip label="Copy the whole digest">
          <ActionIcon
            size="sm"
            variant="subtle"
            aria-label={`Copy the digest of ${number}`}
            onClick={() => void copied(digest, "The digest")}
          >
            <IconCopy size={13} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </p>
      {released && (
        <p className={style.facts}>
          <IconRosetteDiscountCheck size={14} aria-hidden />
          <span>
            Released by <bdi>{authorName(released.by)}</bdi>, {timeWords(released.at, now)}
          </span>
        </p>
      )}
      <Runs runs={runs} now={now} />
      {chosen && <InsideVersion version={version} />}
      {chosen && <Ways {...props} />}
    </li>
  );
}

const NONE: readonly PinnedGraph[] = [];

/** Return whether the name of a pinned sub-graph still stands for the same graph. */
function stateOf({ digest, current_digest }: PinnedGraph): "same" | "changed" | "gone" {
  if (current_digest === null) return "gone";
  return current_digest === digest ? "same" : "changed";
}

const STATE_WORDS = { same: "as it is now", changed: "changed since", gone: "no graph any more" };

function InsideVersion({ version }: { version: Version }) {
  const { id, digest, tree_digest } = version;
  const { data: graphs = NONE } = useQuery({
    enabled: tree_digest !== null && tree_digest !== digest,
    queryKey: ["versions", id, "inside"],
    queryFn: async ({ signal }) => (await fetchVersion(id, signal)).subgraphs ?? NONE,
    staleTime: 0,
  });
  if (graphs.length === 0) return null;
  const changed = graphs.filter((each) => stateOf(each) !== "same").length;
  return (
    <>
      <p className={style.quiet}>
        {counted(graphs.length, "graph")} inside
        {changed > 0 && `, ${changed} changed since: a new version takes them as they are now`}
      </p>
      <ul className={style.inside} aria-label="Graphs inside of it">
        {graphs.map((each) => (
          <li key={each.name} data-state={stateOf(each)}>
            <Link to={`/graphs/${each.graph}`}>
              <bdi>{each.name}</bdi>
            </Link>
            <code title={each.digest}>{shortDigest(each.digest)}</code>
            <span className={style.quiet}>{STATE_WORDS[stateOf(each)]}</span>
          </li>
        ))}
      </ul>
    </>
  );
}

export interface ListedVersion {
  readonly version: Version;
  /** `v11`: its place among all of them. */
  readonly number: string;
  /** Its runs, the newest first. */
  readonly runs: readonly ListedRun[];
}

/** Returns versions with their runs. `versions` and `runs`: the newest first. */
export function listedVersions(
  versions: readonly Version[],
  runs: readonly ListedRun[],
): ListedVersion[] {
  const of = new Map<string, ListedRun[]>();
  for (const run of runs) {
    if (run.version === null) continue;
    const known = of.get(run.version);
    if (known) known.push(run);
    else of.set(run.version, [run]);
  }
  return versions.map((version, i) => ({
    version,
    number: `v${versions.length - i}`,
    runs: of.get(version.id) ?? [],
  }));
}

interface ResultCount {
  readonly tone: Tone;
  readonly word: string;
  readonly count: number;
}

/** Return how often the runs of a version ended in each way, the most frequent first. */
function resultCounts(runs: readonly ListedRun[], heard: Heard): ResultCount[] {
  const found = new Map<string, ResultCount>();
  for (const run of runs) {
    const { tone, word } = runStatus(run, heard);
    const known = found.get(word);
    found.set(word, { tone, word, count: (known?.count ?? 0) + 1 });
  }
  return [...found.values()].sort((a, b) => b.count - a.count);
}

/** Returns the runs of a version in words, as `3 runs: 2 finished, 1 error`. */
export function runsWords(runs: readonly ListedRun[], heard: Heard): string {
  const [only, ...others] = runs;
  if (only === undefined) return "No run yet";
  const counted = resultCounts(runs, heard).map(({ word, count }) => `${count} ${word}`);
  return `${others.length === 0 ? "1 run" : `${runs.length} runs`}: ${counted.join(", ")}`;
}

/** The start of a digest, by which people tell versions apart. */
const shortDigest = (digest: string): string => digest.slice(0, 8);
