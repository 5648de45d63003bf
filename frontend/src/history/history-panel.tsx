/** The history of the open graph beside its canvas: days, what people did in words, versions and runs. */
import { Button, Checkbox, Skeleton } from "@mantine/core";
import { useSessionStorage } from "@mantine/hooks";
import { type KeyboardEvent, type ReactNode, useEffect, useRef, useState } from "react";
import { Link } from "wouter";
import { authorName, versionName } from "../api/graphs";
import type { HistoryEntry } from "../api/history";
import { errorText } from "../api/http";
import type { ListedRun } from "../api/review";
import { useEditorContext } from "../edit-actions/editor-context";
import { useRunStatus } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import { keyOf } from "../ui/keys";
import { Segments } from "../ui/segments";
import { day, hourMinute, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import { EntryRow } from "./entry-row";
import style from "./history-panel.module.css";
import { doneWords } from "./history-words";
import { useGoingBack } from "./restoring";
import { useSinceOn } from "./since-marks";
import {
  daysOf,
  entryAt,
  entryKey,
  type Timeline,
  type TimelineItem,
  useTimeline,
} from "./timeline";
import { VersionsList } from "./versions-list";

const sentence = (words: string): string => words.charAt(0).toUpperCase() + words.slice(1);

/** ↑ and ↓ go from entry to entry, and to the ways back of the chosen one by Tab. */
function onArrowKeys(event: KeyboardEvent<HTMLElement>): void {
  const step = { ArrowDown: 1, ArrowUp: -1 }[keyOf(event)];
  if (step === undefined) return;
  const all = [...event.currentTarget.querySelectorAll<HTMLElement>("[data-entry], [data-run] a")];
  const at = all.indexOf(document.activeElement as HTMLElement);
  if (at < 0) return;
  event.preventDefault();
  all[at + step]?.focus();
}

/** Return words for an entry beside its changes, such as restoring a moment. */
function didWords(entry: HistoryEntry, entries: readonly HistoryEntry[], now: number) {
  if (entry.kind === "edited") return entry.changes === undefined ? "changed it" : null;
  if (entry.reverted) return `undid what ${isolated(entry.reverted.author.name || "somebody")} did`;
  if (entry.restored === undefined) return doneWords(entry);
  const of = entryAt(entries, entry.restored);
  const at = of === null ? null : Date.parse(of.until);
  return at === null ? "restored it" : `restored it as of ${day(at, now)}`;
}

/** Loads what is older as soon as one comes near the end. */
function Older({ timeline }: { timeline: Timeline }) {
  const end = useRef<HTMLDivElement>(null);
  const load = useRef(timeline.loadOlder);
  load.current = timeline.loadOlder;
  useEffect(() => {
    const seen = new IntersectionObserver(([each]) => each?.isIntersecting && load.current());
    if (end.current) seen.observe(end.current);
    return () => seen.disconnect();
  }, []);
  return (
    <div ref={end} className={`${style.older} fingers`}>
      <Button
        size="compact-sm"
        variant="subtle"
        loading={timeline.isLoadingOlder}
        onClick={timeline.loadOlder}
      >
        What was before
      </Button>
    </div>
  );
}

function Items({ items, timeline }: { items: readonly TimelineItem[]; timeline: Timeline }) {
  const context = useEditorContext();
  const { past, lookAt, mayGoBack } = context;
  const { seq } = useThrottledLink();
  const now = useNow(60_000);
  const { entries, versions } = timeline;
  const colorOf = usePersonColors(entries.map(({ author }) => author.id));
  const { busy, revert, restore } = useGoingBack(context);
  const [chosen, setChosen] = useState("");
  const here = past && entries.find((e) => e.seq === past.at && entryKey(e) === chosen);
  const shown = past && (here ?? entryAt(entries, past.at));
  return items.map((item) => {
    if (item.kind === "run") {
      const { run } = item;
      return <RunRow key={run.id} run={run} version={versionName(versions, run.version)} />;
    }
    const { entry } = item;
    const choose = () => {
      if (entry.seq < 1) return;
      setChosen(entryKey(entry));
      lookAt(shown === entry ? null : { at: entry.seq, with: past?.with ?? "good" });
    };
    const common = { entry, chosen: shown === entry, onChoose: choose };
    if (entry.kind === "published") {
      const name = versionName(versions, entry.version?.id ?? null) || entry.version?.label;
      return <VersionRow key={entryKey(entry)} {...common} name={name || "version"} />;
    }
    return (
      <EntryRow
        key={entryKey(entry)}
        {...common}
        color={colorOf(entry.author.id)}
        did={didWords(entry, entries, now)}
        now={seq}
        mayEdit={mayGoBack}
        busy={busy}
        onRevert={() => void revert(entry)}
        onRestore={() => void restore(entry.seq)}
      />
    );
  });
}

/** The question after a run that failed: what is another since it went well? */
function SinceLastGood({ timeline: { lastGood } }: { timeline: Timeline }) {
  const { past, lookAt } = useEditorContext();
  const { seq } = useThrottledLink();
  const [marked, setMarked] = useSinceOn();
  if (lastGood === null || lastGood.seq >= seq) return null;
  const on = past?.at === seq && (past.with === "good" || past.with === lastGood.seq);
  return (
    <div className={style.since}>
      <Button
        fullWidth
        size="compact-sm"
        variant="light"
        className={style.question ?? ""}
        aria-pressed={on}
        onClick={() => lookAt(on ? null : { at: seq, with: "good" })}
      >
        What changed since run {lastGood.run}, which went well
      </Button>
      <Checkbox
        mt={6}
        size="xs"
        label="Mark it on the canvas"
        checked={marked}
        onChange={(event) => setMarked(event.currentTarget.checked)}
      />
    </div>
  );
}

function Days({ timeline }: { timeline: Timeline }) {
  const now = useNow(60_000);
  return (
    <>
      <SinceLastGood timeline={timeline} />
      {daysOf(timeline.items).map(({ at, items }) => (
        <section key={new Date(at).toDateString()} className={style.day}>
          <h3>{sentence(day(at, now))}</h3>
          <ol>
            <Items items={items} timeline={timeline} />
          </ol>
        </section>
      ))}
      {timeline.hasOlder && <Older timeline={timeline} />}
    </>
  );
}

type HistoryView = "history" | "versions";

/** Shows the history and the versions of a graph. `above`: what else there is of it, as its drafts. */
export function HistoryPanel({ above }: { above?: ReactNode }) {
  const { id } = useEditorContext();
  const timeline = useTimeline(id);
  const [view, setView] = useSessionStorage<HistoryView>({
    key: "aa.history-view",
    defaultValue: "history",
    getInitialValueInEffect: false,
  });
  const count = timeline.versions.length;
  const views = [
    { value: "history", label: "History" },
    { value: "versions", label: `Versions\u00a0${count}` },
  ] as const;
  return (
    <section className={style.panel} aria-label="History" data-history onKeyDown={onArrowKeys}>
      <h2 className="visually-hidden">History</h2>
      <div className={style.views}>
        <Segments
          label="What of the history"
          fullWidth
          size="xs"
          data={views}
          value={view}
          onChange={setView}
        />
      </div>
      {timeline.isPending && <Skeleton height={160} m="sm" />}
      {timeline.error && <p role="alert">{errorText(timeline.error)}</p>}
      {view === "history" && above}
      {view === "history" ? <Days timeline={timeline} /> : <VersionsList timeline={timeline} />}
    </section>
  );
}

const timeOf = (text: string | null): string => {
  const at = instant(text);
  return at === null ? "" : hourMinute(at);
};

interface VersionProps {
  entry: HistoryEntry;
  /** Name of the version: its label, or its number. */
  name: string;
  chosen: boolean;
  onChoose: () => void;
}

export function VersionRow({ entry, name, chosen, onChoose }: VersionProps) {
  return (
    <li className={style.mark} data-chosen={chosen || undefined}>
      <button type="button" aria-pressed={chosen} data-entry onClick={onChoose}>
        <span className={style.version}>{name}</span>
        <span>
          kept by <bdi>{authorName(entry.author)}</bdi>
        </span>
        <time dateTime={entry.until}>{timeOf(entry.until)}</time>
      </button>
    </li>
  );
}

export function RunRow({ run, version }: { run: ListedRun; version: string }) {
  const { tone, word } = useRunStatus(run);
  const at = run.started_at ?? run.requested_at;
  return (
    <li className={style.mark} data-run={run.number}>
      <Link to={`/runs/${run.id}`}>
        <StateLabel still tone={tone} word={`Run ${run.number}`} />
        <span>
          {version === "" ? "" : `${version} · `}
          {word}
        </span>
        <time dateTime={at}>{timeOf(at)}</time>
      </Link>
    </li>
  );
}
