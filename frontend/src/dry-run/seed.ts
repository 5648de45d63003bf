/** A moment of a recorded run as the beginning of a dry-run: what was so, and what nobody knows. Pure. */
import type { Behaviour } from "../api/dry-runs";
import type { Visit } from "../api/runs";
import type { StartValues } from "../api/starts";
import type { Key } from "../graph/model";
import type { PlaybackState } from "./playback";

/** Fact that the record does not contain, so that the dry-run had to choose. */
export interface SeedDoubt {
  /** The action's full name; empty: it is about the whole. */
  readonly node: string;
  readonly text: string;
}

export interface SeededAction {
  readonly node: string;
  /** Visits that had begun by then, and how many of them had ended. */
  readonly begun: number;
  readonly ended: number;
}

/** A value that an action ran with, as its engine reported it. */
export interface SeedValue {
  readonly node: string;
  readonly name: string;
  readonly text: string;
}

export interface DryRunSeed {
  readonly run: string;
  readonly number: number;
  /** ms after the run's start. */
  readonly at: number;
  /** Outcomes of actions until then, one behaviour for each call. */
  readonly behaviours: Readonly<Record<string, readonly Behaviour[]>>;
  readonly actions: readonly SeededAction[];
  /** The values of each visit that had begun by then, as engines report them; null: not seen. */
  readonly inputs: Readonly<Record<string, readonly Visit["inputs"][]>>;
  /**
   * Ends that the visits going on at the moment had later in the run, by node; shown, not played.
   */
  readonly ends: ReadonlyMap<string, string>;
  readonly values: readonly SeedValue[];
  /** The values with which the run was started. */
  readonly started: StartValues;
  readonly doubts: readonly SeedDoubt[];
}

/**
 * Return the graph to play, with the parameter values that the run had in the visits that are
 * played again.
 */
export function withRecordedValues(
  state: PlaybackState,
  { inputs }: DryRunSeed,
  keys: ReadonlyMap<string, Key>,
): PlaybackState {
  const progress = new Map(state.progress);
  for (const [node, visits] of Object.entries(inputs)) {
    const key = keys.get(node);
    const now = key === undefined ? undefined : progress.get(key);
    const known = visits[(now?.visits ?? 0) - 1];
    if (key !== undefined && now && known) progress.set(key, { ...now, inputs: known });
  }
  return { ...state, progress };
}

/** Return in words where the rules led an action elsewhere than the run; null if they did not. */
function strayed(seeded: SeededAction, state: PlaybackState, keys: ReadonlyMap<string, Key>) {
  const key = keys.get(seeded.node);
  const visits = key === undefined ? 0 : (state.progress.get(key)?.visits ?? 0);
  const goes = state.running.some(({ node }) => node === seeded.node) ? 1 : 0;
  const same = visits === seeded.begun && visits - goes === seeded.ended;
  if (same) return null;
  const told = (begun: number, ended: number) =>
    begun === 0 ? "not run" : begun > ended ? `begun ${begun}×, going on` : `ended ${ended}×`;
  const [there, here] = [told(seeded.begun, seeded.ended), told(visits, visits - goes)];
  return { node: seeded.node, text: `in the run: ${there}; by the engine’s rules: ${here}` };
}

/** The moment of a played trace that is as the run was then, or comes nearest, and what is not. */
export function seededMoment(
  seed: DryRunSeed,
  states: readonly PlaybackState[],
  keys: ReadonlyMap<string, Key>,
): { index: number; doubts: readonly SeedDoubt[] } {
  let best = { index: 0, doubts: [] as readonly SeedDoubt[], least: Number.POSITIVE_INFINITY };
  for (const [index, state] of states.entries()) {
    const doubts = seed.actions.flatMap((each) => strayed(each, state, keys) ?? []);
    if (doubts.length < best.least) best = { index, doubts, least: doubts.length };
  }
  return { index: best.index, doubts: best.doubts };
}
