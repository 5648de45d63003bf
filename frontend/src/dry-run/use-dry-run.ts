/** The state of a dry-run: what is played, where in it one is, and what was decided. */
import {
  type Dispatch,
  type SetStateAction,
  useCallback,
  useEffect,
  useMemo,
  useState,
} from "react";
import { type DryRunPart, type TraceEvent, useDryRunResult } from "../api/dry-runs";
import type { AskedInput, StartValues } from "../api/starts";
import type { Graph, Key } from "../graph/model";
import { endName } from "../graph/relation-words";
import type { Progress } from "../status/progress";
import { withWaits } from "../status/waits";
import {
  keysByName,
  momentsOf,
  momentWords,
  type PlaybackState,
  playbackStateAt,
} from "./playback";
import {
  commandsOf,
  type DecidedFault,
  type DecidedOutcome,
  type Decisions,
  decide,
  decidedBy,
  NOTHING_DECIDED,
  rewritesRun,
  scriptOf,
} from "./script";
import { type DryRunSeed, type SeedDoubt, seededMoment, withRecordedValues } from "./seed";

export const DRY_RUN_SPEEDS = [0.5, 1, 4, 16] as const;

/** The values with which a dry-run is played. */
interface GivenValues {
  /** Texts that a person typed, by place; they outlive a change of the layout. */
  readonly edited: Readonly<Record<string, string>>;
  readonly values: StartValues;
  /** Text that says what a person has to do before the graph can be started with values; null if nothing. */
  readonly missing: string | null;
}

export interface DryRun {
  readonly moments: readonly { readonly at: number }[];
  /** The moment that is shown. */
  readonly index: number;
  readonly sighting: PlaybackState;
  /** Return the progress of a graph that runs inside; its name is the one that engines use. */
  inside(graph: Pick<Graph, "name" | "actions">): PlaybackState["progress"];
  /** Events of this moment in words. */
  readonly words: readonly string[];
  readonly playing: boolean;
  readonly speed: number;
  readonly decided: Decisions;
  /** Still being worked out. */
  readonly busy: boolean;
  readonly failed: Error | null;
  readonly cut: boolean;
  /** The inputs for which a start of the graph asks. */
  readonly asked: readonly AskedInput[];
  /** Null until the form for the values is there. */
  readonly given: GivenValues | null;
  /** The moment of a run from which it starts; null: from its own start. */
  readonly seed: DryRunSeed | null;
  /** The part with which it begins; null: with the entry. */
  readonly part: DryRunPart | null;
  /** Facts of that moment that are unknown, or that the rules do not reach. */
  readonly doubts: readonly SeedDoubt[];
  go(index: number): void;
  play(on: boolean): void;
  setSpeed(speed: number): void;
  /** Decide how the running action ends: that with the given key, else the first. */
  choose(outcome: DecidedOutcome, key?: Key): void;
  inject(fault: DecidedFault | null): void;
  give(given: GivenValues): void;
  /** From the start, as if nothing had been decided. */
  restart(): void;
  close(): void;
}

const EMPTY: PlaybackState = { progress: new Map<Key, Progress>(), running: [], state: "" };

/** The moment that is shown: which one, what is seen there, and what it says in words. */
function useShownMoment(
  trace: readonly TraceEvent[],
  at: number,
  graph: Graph,
  seed: DryRunSeed | null,
) {
  const moments = useMemo(() => momentsOf(trace), [trace]);
  const index = Math.max(
    0,
    moments.findLastIndex((moment) => moment.at <= at),
  );
  const sighting = useMemo(() => {
    const moment = moments[index];
    if (!moment) return EMPTY;
    const keys = keysByName(graph);
    const played = playbackStateAt(trace, moment.to, graph, keys);
    const state = { ...played, progress: withWaits(graph, played.progress) };
    return seed === null ? state : withRecordedValues(state, seed, keys);
  }, [trace, moments, index, graph, seed]);
  const words = useMemo(() => {
    const moment = moments[index];
    const keys = keysByName(graph);
    const nameOf = (node: string) => {
      const key = keys.get(node);
      return key === undefined ? node : endName(graph, key);
    };
    return moment ? momentWords(trace, moment, moments[index - 1]?.to ?? 0, nameOf) : [];
  }, [trace, moments, index, graph]);
  const inside = useCallback<DryRun["inside"]>(
    (below) => playbackStateAt(trace, moments[index]?.to ?? 0, below).progress,
    [trace, moments, index],
  );
  return useMemo(
    () => ({ moments, index, sighting, words, inside }),
    [moments, index, sighting, words, inside],
  );
}

/** Goes to the moment of a run from which a dry-run starts, once it is played; says what is not so. */
function useSeed(
  seed: DryRunSeed | null,
  trace: readonly TraceEvent[],
  graph: Graph,
  busy: boolean,
  setAt: (at: number) => void,
): readonly SeedDoubt[] {
  const [found, setFound] = useState<{ of: DryRunSeed | null; doubts: readonly SeedDoubt[] }>(NONE);
  useEffect(() => {
    if (seed === null || busy || found.of === seed) return;
    const keys = keysByName(graph);
    const moments = momentsOf(trace);
    const states = moments.map(({ to }) => playbackStateAt(trace, to, graph, keys));
    const { index, doubts } = seededMoment(seed, states, keys);
    setAt(moments[index]?.at ?? 0);
    setFound({ of: seed, doubts: [...seed.doubts, ...doubts] });
  }, [seed, trace, graph, busy, found, setAt]);
  return found.of === seed ? found.doubts : (seed?.doubts ?? NONE.doubts);
}

const NONE = { of: null, doubts: [] as readonly SeedDoubt[] };

/** Decides at the moment that is shown; `setGoal`: what comes after it is to be shown next. */
function useDeciding(
  { moments, index, sighting }: ReturnType<typeof useShownMoment>,
  setDecided: Dispatch<SetStateAction<Decisions>>,
  setGoal: (goal: number) => void,
) {
  const choose = useCallback(
    (outcome: DecidedOutcome, key?: Key) => {
      const going = sighting.running.find((each) => each.key === key) ?? sighting.running[0];
      const now = moments[index]?.at;
      if (!going || now === undefined) return;
      setDecided((before) => decide(before, going, outcome, now));
      setGoal(now);
    },
    [sighting, moments, index, setDecided, setGoal],
  );
  const inject = useCallback(
    (fault: DecidedFault | null) => {
      setDecided((before) => ({ ...before, fault }));
      const now = moments[index]?.at;
      if (fault?.kind === "stop" && now !== undefined) setGoal(now);
    },
    [moments, index, setDecided, setGoal],
  );
  return useMemo(() => ({ choose, inject }), [choose, inject]);
}

/** Ask the editor for the result of the decisions while a dry-run is open. */
function useResult(
  id: string,
  open: boolean,
  seq: number,
  decided: Decisions,
  part: DryRunPart | null,
  values: StartValues = NO_VALUES,
) {
  const wanted = useMemo(() => {
    if (!open) return null;
    const played = { seq, script: scriptOf(decided), commands: commandsOf(decided), values };
    return part === null ? played : { ...played, from: part };
  }, [open, seq, decided, values, part]);
  return useDryRunResult(id, wanted);
}

const NO_VALUES: StartValues = {};
const NOT_ASKED: readonly AskedInput[] = [];

/** Keeps how a dry-run begins, what was decided since, and the moment that is shown. */
function useDecisions() {
  const [seed, setSeed] = useState<DryRunSeed | null>(null);
  const [part, setPart] = useState<DryRunPart | null>(null);
  const [beginning, setBeginning] = useState(NOTHING_DECIDED);
  const [decided, setDecided] = useState(NOTHING_DECIDED);
  const [at, setAt] = useState(0);
  const [playing, play] = useState(false);
  const [given, give] = useState<GivenValues | null>(null);
  const from = useCallback((before: Decisions) => {
    setDecided(before);
    setAt(0);
    play(false);
  }, []);
  const begin = useCallback(
    (
      seeded: DryRunSeed | null = null,
      script: DryRunSeed["behaviours"] = {},
      begins: DryRunPart | null = null,
    ) => {
      const before = seeded === null ? { ...NOTHING_DECIDED, before: script } : decidedBy(seeded);
      setSeed(seeded);
      setPart(begins);
      setBeginning(before);
      give(null);
      from(before);
    },
    [from],
  );
  const restart = useCallback(() => from(beginning), [from, beginning]);
  return { seed, part, decided, setDecided, at, setAt, playing, play, given, give, begin, restart };
}

/**
 * Keeps the state of the dry-run of a graph; its result is null while none is open. `seq`: the moment of the graph
 * that the page shows.
 */
export function useDryRun(id: string, graph: Graph, seq: number) {
  const [open, setOpen] = useState(false);
  const { seed, part, decided, setDecided, at, setAt, playing, play, given, give, ...beginnings } =
    useDecisions();
  const [goal, setGoal] = useState<number | null>(null);
  const [speed, setSpeed] = useState<number>(1);
  const result = useResult(id, open, seq, decided, part, given?.values);
  const { data, isPlaceholderData, error: failed } = result;
  const busy = data === undefined || isPlaceholderData;
  const trace = useMemo(() => data?.trace ?? [], [data]);
  const shown = useShownMoment(trace, at, graph, seed && !rewritesRun(decided, seed) ? seed : null);
  const { moments, index } = shown;
  const doubts = useSeed(open ? seed : null, trace, graph, busy, setAt);

  // After a decision the next thing that happens is shown, as soon as it is known.
  useEffect(() => {
    if (goal === null || busy) return;
    setAt((moments.find((moment) => moment.at > goal) ?? moments.at(-1))?.at ?? 0);
    setGoal(null);
  }, [goal, busy, moments, setAt]);

  const go = useCallback(
    (to: number) => setAt(moments[Math.max(0, Math.min(moments.length - 1, to))]?.at ?? 0),
    [moments, setAt],
  );
  usePlaying({ on: open && playing && !busy, moments, index, speed, go, play });

  const deciding = useDeciding(shown, setDecided, setGoal);
  const { begin: reset, restart } = beginnings;
  const begin = useCallback(
    (...from: Parameters<typeof reset>) => {
      reset(...from);
      setOpen(true);
    },
    [reset],
  );
  const close = useCallback(() => {
    reset();
    setOpen(false);
  }, [reset]);

  const cut = data?.cut === true;
  const asked = data?.asked ?? NOT_ASKED;
  const commands = useMemo(
    () => ({ go, play, setSpeed, ...deciding, give, restart, close }),
    [go, deciding, give, restart, close, play],
  );
  const dryRun = useMemo<DryRun | null>(
    () =>
      open
        ? {
            ...shown,
            ...{ playing, speed, decided, busy, failed, cut, asked, given, seed, part, doubts },
            ...commands,
          }
        : null,
    [
      open,
      shown,
      playing,
      speed,
      decided,
      busy,
      failed,
      cut,
      asked,
      given,
      seed,
      part,
      doubts,
      commands,
    ],
  );
  return { dryRun, begin };
}

interface Playing {
  readonly on: boolean;
  readonly moments: readonly { readonly at: number }[];
  readonly index: number;
  readonly speed: number;
  go(index: number): void;
  play(on: boolean): void;
}

/** Goes on by itself: as long as things take, but neither too fast to see nor endlessly. */
function usePlaying({ on, moments, index, speed, go, play }: Playing): void {
  useEffect(() => {
    if (!on) return;
    const [now, next] = [moments[index], moments[index + 1]];
    if (!now || !next) {
      play(false);
      return;
    }
    const wait = Math.min(2_500, Math.max(120, (next.at - now.at) / speed));
    const timer = setTimeout(() => go(index + 1), wait);
    return () => clearTimeout(timer);
  }, [on, moments, index, speed, go, play]);
}
