/** Edit actions of a dry-run: play the graph on the canvas, step by step, and decide how things end. */
import {
  IconCheck,
  IconExclamationMark,
  IconFlask,
  IconPlayerPlay,
  IconPlayerSkipBack,
  IconPlayerTrackNext,
  IconPlayerTrackPrev,
  IconX,
} from "@tabler/icons-react";
import type { DecidedOutcome } from "../dry-run/script";
import type { EditAction } from "./edit-action";
import type { EditorContext } from "./editor-context";

const part = { group: "Dry-run", changes: false, also: "simulate rehearse play test" } as const;
const playing = (context: EditorContext) =>
  context.dryRun !== null && context.dryRun.moments.length > 0;

export const dryRun: EditAction = {
  ...part,
  name: "dry-run",
  label: "Dry-run",
  shortcuts: ["d"],
  icon: IconFlask,
  enabled: ({ dryRun: open, past, graph }) =>
    open !== null || (past === null && graph.actions.length > 0),
  run: (context) => (context.dryRun === null ? context.beginDryRun() : context.dryRun.close()),
};

export const play: EditAction = {
  ...part,
  name: "dry-run-play",
  label: "Play and pause",
  shortcuts: ["p"],
  icon: IconPlayerPlay,
  enabled: playing,
  run: ({ dryRun: run }) => {
    if (run === null) return;
    if (!run.playing && run.index >= run.moments.length - 1) run.go(0);
    run.play(!run.playing);
  },
};

const step = (
  by: 1 | -1,
  label: string,
  shortcut: string,
  icon: EditAction["icon"],
): EditAction => ({
  ...part,
  name: `dry-run-${by === 1 ? "next" : "back"}`,
  label,
  shortcuts: [shortcut],
  icon,
  enabled: (context) =>
    context.dryRun !== null &&
    (by === 1
      ? context.dryRun.index < context.dryRun.moments.length - 1
      : context.dryRun.index > 0),
  run: ({ dryRun: run }) => {
    run?.play(false);
    run?.go(run.index + by);
  },
});

export const next = step(1, "Next moment", ".", IconPlayerTrackNext);
export const back = step(-1, "Moment before", ",", IconPlayerTrackPrev);

export const restart: EditAction = {
  ...part,
  name: "dry-run-restart",
  label: "From the start, undecided",
  shortcuts: ["0"],
  icon: IconPlayerSkipBack,
  enabled: playing,
  run: (context) => context.dryRun?.restart(),
};

const choice = (
  outcome: DecidedOutcome,
  label: string,
  shortcut: string,
  icon: EditAction["icon"],
): EditAction => ({
  ...part,
  name: `dry-run-${outcome}`,
  label,
  shortcuts: [shortcut],
  icon,
  enabled: (context) => (context.dryRun?.sighting.running.length ?? 0) > 0,
  run: ({ dryRun: run, selection }) => {
    const chosen = run?.sighting.running.find(({ key }) => selection.has(key));
    run?.choose(outcome, chosen?.key);
  },
});

const CHOICES: readonly EditAction[] = [
  choice("on_true", "It ends true", "1", IconCheck),
  choice("on_false", "It ends false", "2", IconX),
  choice("on_error", "It ends with an error", "3", IconExclamationMark),
];

export const DRY_RUN: readonly EditAction[] = [dryRun, play, next, back, restart, ...CHOICES];
