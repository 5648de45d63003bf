/** Edit actions that place things: align, distribute, tidy, nudge, snap. */
import {
  IconArrowDown,
  IconArrowLeft,
  IconArrowRight,
  IconArrowsRightDown,
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
import { type Align, align, type Block, distribute } from "../canvas/geometry/align";
import { CARD } from "../canvas/geometry/ranks";
import { asOneEdit } from "../graph/edit";
import { straighten } from "../graph/edit/waypoints";
import type { EditAction } from "./edit-action";
import {
  type EditorContext,
  GRID,
  nudging,
  selectedActions,
  selectedNotes,
  writePositions,
} from "./editor-context";
import { layOutGraph, layOutSome } from "./layout";

/** Returns the boxes of all chosen things that have a place: actions, ends, notes. */
function blocks(context: EditorContext): Block[] {
  const [places, sizes] = [context.positions(), context.sizes()];
  return [...context.selection].flatMap((key) => {
    const at = places.get(key);
    return at ? [{ key, x: at[0], y: at[1], ...(sizes.get(key) ?? CARD) }] : [];
  });
}

const several = (least: number) => (context: EditorContext) => blocks(context).length >= least;

function aligned(
  name: Align,
  label: string,
  icon: EditAction["icon"],
  shortcut?: string,
): EditAction {
  return {
    name: `align-${name}`,
    label,
    group: "Arrange",
    shortcuts: shortcut === undefined ? [] : [shortcut],
    icon,
    changes: true,
    also: "align",
    enabled: several(2),
    run: (context) => writePositions(context, align(blocks(context), name)),
  };
}

export const ALIGN: readonly EditAction[] = [
  aligned("left", "Align left", IconLayoutAlignLeft, "Alt+Shift+ArrowLeft"),
  aligned("center", "Align centres", IconLayoutAlignCenter),
  aligned("right", "Align right", IconLayoutAlignRight, "Alt+Shift+ArrowRight"),
  aligned("top", "Align top", IconLayoutAlignTop, "Alt+Shift+ArrowUp"),
  aligned("middle", "Align middles", IconLayoutAlignMiddle),
  aligned("bottom", "Align bottom", IconLayoutAlignBottom, "Alt+Shift+ArrowDown"),
];

const spread = (axis: "x" | "y", label: string, icon: EditAction["icon"]): EditAction => ({
  name: `distribute-${axis}`,
  label,
  group: "Arrange",
  shortcuts: [],
  icon,
  changes: true,
  also: "distribute spacing",
  enabled: several(3),
  run: (context) => writePositions(context, distribute(blocks(context), axis)),
});

export const DISTRIBUTE: readonly EditAction[] = [
  spread("x", "Distribute across", IconLayoutDistributeHorizontal),
  spread("y", "Distribute down", IconLayoutDistributeVertical),
];

export const tidy: EditAction = {
  name: "tidy",
  label: "Tidy",
  group: "Arrange",
  shortcuts: ["Shift+t"],
  icon: IconSitemap,
  changes: true,
  also: "auto layout arrange whole graph",
  enabled: (context) => context.graph.actions.length > 0,
  run: (context) => void layOutGraph(context),
};

export const turn: EditAction = {
  name: "turn",
  label: "Left to right, or top down",
  group: "Arrange",
  shortcuts: ["Shift+d"],
  icon: IconArrowsRightDown,
  changes: true,
  also: "direction landscape portrait horizontal vertical layout orientation turn switch",
  enabled: (context) => context.graph.actions.length > 0,
  run: (context) =>
    void layOutGraph(context, context.graph.direction === "right" ? "down" : "right"),
};

export const tidySelection: EditAction = {
  name: "tidy-selection",
  label: "Tidy the selection",
  group: "Arrange",
  shortcuts: ["t"],
  icon: IconSitemap,
  changes: true,
  also: "auto layout arrange",
  enabled: (context) => selectedActions(context).length > 1,
  run: (context) => {
    const keys = new Set(selectedActions(context).map(({ key }) => key));
    void layOutSome(context, keys).then((places) => {
      if (places === null) return;
      const inside = context.graph.relations.filter(
        ({ parent, child }) => keys.has(parent) && keys.has(child),
      );
      asOneEdit(context.doc, () => {
        straighten(context.doc, inside);
        writePositions(context, places);
      });
    });
  },
};

export const snap: EditAction = {
  name: "snap",
  label: "Snap to the grid",
  group: "Arrange",
  shortcuts: ["g"],
  icon: IconGrid4x4,
  changes: false,
  enabled: () => true,
  run: (context) => context.setSnap(!context.snap),
};

const STEP = 8; // px; with Shift four times as far

const WAYS = {
  ArrowLeft: [-1, 0, "left", IconArrowLeft],
  ArrowRight: [1, 0, "right", IconArrowRight],
  ArrowUp: [0, -1, "up", IconArrowUp],
  ArrowDown: [0, 1, "down", IconArrowDown],
} as const;

function nudge(context: EditorContext, dx: number, dy: number): void {
  const step = context.snap ? GRID : STEP;
  const moved = new Map(
    blocks(context).map(({ key, x, y }) => [key, [x + dx * step, y + dy * step] as const]),
  );
  nudging(context, "cards", () => writePositions(context, moved));
}

export const NUDGE: readonly EditAction[] = Object.entries(WAYS).flatMap(
  ([key, [dx, dy, word, icon]]) =>
    ([1, 4] as const).map(
      (far): EditAction => ({
        name: `nudge-${word}-${far}`,
        label: far === 1 ? `Move ${word}` : `Move far ${word}`,
        group: "Arrange",
        shortcuts: [far === 1 ? key : `Shift+${key}`],
        icon,
        changes: true,
        also: "nudge",
        enabled: (context) => selectedActions(context).length + selectedNotes(context).length > 0,
        run: (context) => nudge(context, dx * far, dy * far),
      }),
    ),
);
