/** Chooses what a moment is compared with: another one that has a name, or a version that robots run now. */
import { NativeSelect } from "@mantine/core";
import { useMemo } from "react";
import { versionName } from "../api/graphs";
import { openRuns } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { type PastPlace, useEditorContext } from "../edit-actions/editor-context";
import { useNow } from "../ui/times";
import { momentWords, type RunningGraph, runningOf } from "./compared";
import type { Timeline } from "./timeline";
import { goodBefore } from "./timeline";

/** Return the graphs that robots run now, of the graph with this id. */
export function useRunning(id: string, { versions }: Timeline): readonly RunningGraph[] {
  const { now } = useLive();
  return useMemo(() => runningOf(openRuns(now), id, versions), [now, id, versions]);
}

interface Props {
  place: PastPlace;
  timeline: Timeline;
  running: readonly RunningGraph[];
  newest: number;
}

interface Choice {
  readonly value: string;
  readonly label: string;
}

function choicesOf({ place, timeline, running }: Props, now: number): Choice[] {
  const { versions, entries, goods } = timeline;
  const good = goodBefore(goods, place.at);
  const named: Choice[] = [
    ...(good === null
      ? []
      : [{ value: "good", label: `the last good run before it, run ${good.run}` }]),
    { value: "own", label: "the moment before this sitting" },
    { value: "now", label: "now" },
    ...running.map(({ run, words }) => ({ value: `run/${run}`, label: `what runs on ${words}` })),
    ...versions.map(({ id, seq }) => ({
      value: `${seq}`,
      label: `version ${versionName(versions, id)}`,
    })),
    { value: "here", label: "this moment, from here on" },
    { value: "nothing", label: "nothing" },
  ];
  const chosen = chosenOf(place, good !== null);
  if (named.some(({ value }) => value === chosen)) return distinct(named);
  const label =
    typeof place.with === "number" ? momentWords(entries, place.with, now) : "a run that was";
  return distinct([...named, { value: chosen, label }]);
}

const distinct = (choices: readonly Choice[]): Choice[] =>
  choices.filter(({ value }, i) => choices.findIndex((each) => each.value === value) === i);

/**
 * Return the value of the chosen option: a sitting by itself (`own`) if no run went well before.
 */
const chosenOf = ({ with: other }: PastPlace, good: boolean): string =>
  other === "good" && !good ? "own" : `${other}`;

const WORDS = ["own", "good", "now", "nothing"] as const;

function chosenPlace(value: string, at: number): PastPlace {
  const word = WORDS.find((each) => each === value);
  if (word !== undefined) return { at, with: word };
  if (value.startsWith("run/")) return { at, with: value as `run/${string}` };
  return { at, with: value === "here" ? at : Number(value) };
}

export function CompareWith(props: Props) {
  const { place, timeline, newest } = props;
  const { lookAt } = useEditorContext();
  const now = useNow(60_000);
  return (
    <NativeSelect
      size="xs"
      aria-label="Compare with"
      data={choicesOf(props, now)}
      value={chosenOf(place, goodBefore(timeline.goods, place.at) !== null)}
      disabled={newest === 0}
      onChange={(event) => lookAt(chosenPlace(event.currentTarget.value, place.at))}
    />
  );
}
