/** Deeds that put things in their place: align, distribute, tidy, nudge, snap. */
import {
  IconArrowDown,
  IconArrowLeft,
  IconArrowRight,
  IconArrowUp,
  IconGrid4x4,
  IconLayoutAlignBottom,
  IconLayoutAlignCenter,
  IconLayoutAlignLeft,
  IconLayoutAlignMiddle,
  IconLayoutAlignRight,
  IconLayoutAlignTop,
  IconLayoutDistributeHorizontal,
  IconLayoutDistributeVertical,
  IconSitemap,
} from "@tabler/icons-react";
import { type Align, align, type Block, distribute, tidied } from "../canvas/geometry/align";
import { arrange, CARD } from "../canvas/geometry/arrange";
import { moveActions } from "../graph/edit";
import type { Deed } from "./edit-action";
import { type Bench, GRID, putPlaces, selectedActions, selectedNotes } from "./editor-context";

/** Everything chosen that stands somewhere: actions, ends, notes. */
function blocks(bench: Bench): Block[] {
  const [places, sizes] = [bench.places(), bench.sizes()];
  return [...bench.selection].flatMap((key) => {
    const at = places.get(key);
    return at ? [{ key, x: at[0], y: at[1], ...(sizes.get(key) ?? CARD) }] : [];
  });
}

const several = (least: number) => (bench: Bench) => blocks(bench).length >= least;

function aligned(name: Align, label: string, icon: Deed["icon"], shortcut?: string): Deed {
  return {
    name: `align-${name}`,
    label,
    group: "Arrange",
    shortcuts: shortcut === undefined ? [] : [shortcut],
    icon,
    changes: true,
    also: "align",
    enabled: several(2),
    run: (bench) => putPlaces(bench, align(blocks(bench), name)),
  };
}

export const ALIGN: readonly Deed[] = [
  aligned("left", "Align left", IconLayoutAlignLeft, "Alt+Shift+ArrowLeft"),
  aligned("center", "Align centres", IconLayoutAlignCenter),
  aligned("right", "Align right", IconLayoutAlignRight, "Alt+Shift+ArrowRight"),
  aligned("top", "Align top", IconLayoutAlignTop, "Alt+Shift+ArrowUp"),
  aligned("middle", "Align middles", IconLayoutAlignMiddle),
  aligned("bottom", "Align bottom", IconLayoutAlignBottom, "Alt+Shift+ArrowDown"),
];

const spread = (axis: "x" | "y", label: string, icon: Deed["icon"]): Deed => ({
  name: `distribute-${axis}`,
  label,
  group: "Arrange",
  shortcuts: [],
  icon,
  changes: true,
  also: "distribute spacing",
  enabled: several(3),
  run: (bench) => putPlaces(bench, distribute(blocks(bench), axis)),
});

export const DISTRIBUTE: readonly Deed[] = [
  spread("x", "Distribute across", IconLayoutDistributeHorizontal),
  spread("y", "Distribute down", IconLayoutDistributeVertical),
];

export const tidy: Deed = {
  name: "tidy",
  label: "Tidy",
  group: "Arrange",
  shortcuts: ["Shift+t"],
  icon: IconSitemap,
  changes: true,
  also: "auto layout arrange whole graph",
  enabled: (bench) => bench.graph.actions.length > 0,
  run: (bench) => {
    moveActions(bench.doc, arrange(bench.graph, bench.sizes()));
    requestAnimationFrame(() => bench.view.fit());
  },
};

export const tidySelection: Deed = {
  name: "tidy-selection",
  label: "Tidy the selection",
  group: "Arrange",
  shortcuts: ["t"],
  icon: IconSitemap,
  changes: true,
  also: "auto layout arrange",
  enabled: (bench) => selectedActions(bench).length > 1,
  run: (bench) => {
    const keys = new Set(selectedActions(bench).map(({ key }) => key));
    putPlaces(bench, tidied(bench.graph, keys, bench.places(), bench.sizes()));
  },
};

export const snap: Deed = {
  name: "snap",
  label: "Snap to the grid",
  group: "Arrange",
  shortcuts: ["g"],
  icon: IconGrid4x4,
  changes: false,
  enabled: () => true,
  run: (bench) => bench.setSnap(!bench.snap),
};

const STEP = 8; // px; with Shift four times as far

const WAYS = {
  ArrowLeft: [-1, 0, "left", IconArrowLeft],
  ArrowRight: [1, 0, "right", IconArrowRight],
  ArrowUp: [0, -1, "up", IconArrowUp],
  ArrowDown: [0, 1, "down", IconArrowDown],
} as const;

function nudge(bench: Bench, dx: number, dy: number): void {
  const step = bench.snap ? GRID : STEP;
  const moved = new Map(
    blocks(bench).map(({ key, x, y }) => [key, [x + dx * step, y + dy * step] as const]),
  );
  // Presses in a row are one step of undo.
  const last = bench.undo.undoStack.at(-1);
  bench.undo.captureTimeout = last?.meta.get(NUDGED) === true ? 900 : 0;
  putPlaces(bench, moved);
  bench.undo.captureTimeout = 0;
  bench.undo.undoStack.at(-1)?.meta.set(NUDGED, true);
}
const NUDGED = "nudged";

export const NUDGE: readonly Deed[] = Object.entries(WAYS).flatMap(([key, [dx, dy, word, icon]]) =>
  ([1, 4] as const).map(
    (far): Deed => ({
      name: `nudge-${word}-${far}`,
      label: far === 1 ? `Move ${word}` : `Move far ${word}`,
      group: "Arrange",
      shortcuts: [far === 1 ? key : `Shift+${key}`],
      icon,
      changes: true,
      also: "nudge",
      enabled: (bench) => selectedActions(bench).length + selectedNotes(bench).length > 0,
      run: (bench) => nudge(bench, dx * far, dy * far),
    }),
  ),
);
