/** Edit actions that change the view, not the graph, and those that open a panel or find. */
import {
  IconArrowGuide,
  IconArrowsDiagonal,
  IconArrowsDiagonalMinimize2,
  IconBraces,
  IconCommand,
  IconFocus2,
  IconFocusCentered,
  IconHandStop,
  IconHelpCircle,
  IconListTree,
  IconMarquee2,
  IconMenu2,
  IconMessageCircle,
  IconPackageExport,
  IconSearch,
  IconShieldCheck,
  IconStairsDown,
  IconStairsUp,
  IconZoomIn,
  IconZoomOut,
} from "@tabler/icons-react";
import { ENTRY, type Key } from "../graph/model";
import type { EditAction } from "./edit-action";
import { type EditorContext, selectedActions, selectedRelations } from "./editor-context";

const always = () => true;
const look = { group: "Look", changes: false, enabled: always } as const;

export const palette: EditAction = {
  ...look,
  name: "palette",
  label: "Find a command",
  shortcuts: ["Mod+k"],
  icon: IconCommand,
  also: "command palette go to graph action",
  run: (context) => context.openOverlay({ kind: "palette" }),
};

export const showShortcuts: EditAction = {
  ...look,
  name: "keys",
  label: "Keyboard shortcuts",
  shortcuts: ["?"],
  icon: IconHelpCircle,
  also: "help",
  run: (context) => context.openOverlay({ kind: "keys" }),
};

export const menu: EditAction = {
  ...look,
  name: "menu",
  label: "Menu for the selection",
  shortcuts: ["ContextMenu", "Shift+F10"],
  icon: IconMenu2,
  run: (context) => context.openOverlay({ kind: "menu", screen: spotOf(context) }),
};

/** Returns the place of the selection on the screen; the middle of the canvas without one. */
function spotOf(context: EditorContext): readonly [number, number] {
  const [key] = [...context.selection].filter((each) => context.positions().has(each));
  const at = key === undefined ? undefined : context.positions().get(key);
  const [x, y] = context.view.screenOf(at ?? context.view.middle());
  return [x + 24, y + 24];
}

export const toCanvas: EditAction = {
  ...look,
  name: "to-canvas",
  label: "Back to the canvas",
  shortcuts: ["F6"],
  icon: IconFocusCentered,
  also: "leave the form focus",
  run: (context) => {
    if (document.activeElement instanceof HTMLElement) document.activeElement.blur();
    const [key] = [...context.selection].filter((each) => context.positions().has(each));
    if (key !== undefined) context.view.focus(key);
  },
};

export const fit: EditAction = {
  ...look,
  name: "fit",
  label: "Fit",
  shortcuts: ["f", "Shift+!"],
  icon: IconFocusCentered,
  also: "zoom to fit all",
  run: (context) => context.view.fit(),
};

export const zoomSelection: EditAction = {
  ...look,
  name: "zoom-selection",
  label: "Show the selection",
  shortcuts: ["z", "Shift+@"],
  icon: IconFocus2,
  also: "zoom to selection",
  enabled: (context) => context.selection.size > 0,
  run: (context) => context.view.show(shownKeys(context), "whole"),
};

/** Returns the selected keys that have a place, with both ends of selected arrows. */
export function shownKeys(context: EditorContext): Key[] {
  const ends = selectedRelations(context).flatMap(({ parent, child }) => [parent, child]);
  return [...context.selection, ...ends].filter((key) => context.positions().has(key));
}

export const zoomIn: EditAction = {
  ...look,
  name: "zoom-in",
  label: "Zoom in",
  shortcuts: ["=", "Plus"],
  icon: IconZoomIn,
  run: (context) => context.view.zoomIn(),
};

export const zoomOut: EditAction = {
  ...look,
  name: "zoom-out",
  label: "Zoom out",
  shortcuts: ["-"],
  icon: IconZoomOut,
  run: (context) => context.view.zoomOut(),
};

export const pan: EditAction = {
  ...look,
  name: "pan",
  label: "Pan",
  shortcuts: ["h"],
  icon: IconHandStop,
  run: (context) => context.setTool("pan"),
};

export const marquee: EditAction = {
  ...look,
  name: "marquee",
  label: "Select",
  shortcuts: ["v"],
  icon: IconMarquee2,
  also: "marquee frame several",
  // Pressed once more it is over: small screens show no other way back.
  run: (context) => context.setTool(context.tool === "select" ? "pan" : "select"),
};

export const showJson: EditAction = {
  ...look,
  name: "json",
  label: "Show the JSON",
  shortcuts: ["j"],
  icon: IconBraces,
  run: (context) => context.setPanel("json"),
};

/**
 * The nearest neighbour along arrows: in the direction of the graph to what follows, against it to
 * what comes before, or beside.
 */
export function neighbour(
  context: EditorContext,
  way: "up" | "down" | "left" | "right",
): Key | null {
  const { relations, actions, direction } = context.graph;
  const right = direction === "right";
  const [onward, back] = right ? (["right", "left"] as const) : (["down", "up"] as const);
  const places = context.positions();
  const [arrow] = selectedRelations(context);
  if (arrow && (way === onward || way === back)) return way === back ? arrow.parent : arrow.child;
  const [from] = [...context.selection].filter((key) => places.has(key));
  if (from === undefined)
    return relations.find((r) => r.parent === ENTRY)?.child ?? actions[0]?.key ?? null;
  const at = places.get(from) ?? [0, 0];
  /** Returns the coordinate of a thing across the direction of drawing. */
  const acrossOf = (key: Key) => places.get(key)?.[right ? 1 : 0] ?? 0;
  const after = (key: Key) => relations.filter((r) => r.parent === key).map((r) => r.child);
  const before = (key: Key) => relations.filter((r) => r.child === key).map((r) => r.parent);
  const beside = () =>
    [...new Set([...before(from).flatMap(after), ...after(from).flatMap(before)])].filter(
      (key) => acrossOf(key) !== acrossOf(from),
    );
  const found = way === onward ? after(from) : way === back ? before(from) : beside();
  const fits = (key: Key) => {
    if (key === from) return false;
    if (way === onward || way === back) return true;
    const less = way === "left" || way === "up";
    return less ? acrossOf(key) < acrossOf(from) : acrossOf(key) > acrossOf(from);
  };
  const far = (key: Key) => {
    const [x, y] = places.get(key) ?? [0, 0];
    return Math.hypot(x - at[0], y - at[1]);
  };
  return found.filter(fits).sort((a, b) => far(a) - far(b))[0] ?? null;
}

export const WALK: readonly EditAction[] = (["up", "down", "left", "right"] as const).map(
  (way) => ({
    ...look,
    name: `walk-${way}`,
    label: {
      up: "Go up along the arrows",
      down: "Go down along the arrows",
      left: "Go left along the arrows",
      right: "Go right along the arrows",
    }[way],
    shortcuts: [`Alt+Arrow${way.charAt(0).toUpperCase()}${way.slice(1)}`],
    icon: IconArrowGuide,
    also: "walk neighbour before follows",
    enabled: (context: EditorContext) => context.graph.actions.length > 0,
    run: (context: EditorContext) => {
      const key = neighbour(context, way);
      if (key === null) return;
      context.select([key]);
      context.view.reveal(context.positions().get(key) ?? [0, 0]);
      context.view.focus(key);
    },
  }),
);

/** The one action that is chosen, if it stands for a graph. */
export function chosenGraph(context: EditorContext) {
  const [only, ...others] = selectedActions(context);
  const stands = only !== undefined && context.store.graphsInside.now()?.byName.has(only.name);
  return stands && others.length === 0 ? only : null;
}

export const enter: EditAction = {
  ...look,
  also: "sub-graph level hierarchy",
  name: "enter-graph",
  label: "Open the graph inside",
  shortcuts: ["]", "Mod+ArrowDown"],
  icon: IconStairsDown,
  enabled: (context) => chosenGraph(context) !== null,
  idle: "Choose an action that stands for a graph first.",
  run: (context) => {
    const action = chosenGraph(context);
    if (action) context.store.graphsInside.now()?.enter(action.key);
  },
};

export const leave: EditAction = {
  ...look,
  also: "sub-graph level hierarchy",
  name: "leave-graph",
  label: "Out to the graph around",
  shortcuts: ["[", "Mod+ArrowUp"],
  icon: IconStairsUp,
  enabled: ({ store }) => (store.graphsInside.now()?.leave ?? null) !== null,
  idle: "You came here from no other graph.",
  run: ({ store }) => store.graphsInside.now()?.leave?.(),
};

const inPlace = { ...look, also: "sub-graph level hierarchy in place fold open" } as const;

/** The actions that are chosen and stand for graphs. */
const chosenGraphs = (context: EditorContext) =>
  selectedActions(context).filter(({ name }) => context.store.graphsInside.now()?.byName.has(name));

export const expandGraph: EditAction = {
  ...inPlace,
  name: "expand-graph",
  label: "Expand or collapse the graph inside",
  shortcuts: ["}", "Mod+Shift+ArrowDown"],
  icon: IconArrowsDiagonal,
  enabled: (context) => chosenGraphs(context).length > 0,
  idle: "Choose an action that stands for a graph first.",
  run: (context) => {
    for (const { key } of chosenGraphs(context))
      context.store.graphsInside.now()?.expand.toggle(key);
  },
};

export const expandMore: EditAction = {
  ...inPlace,
  name: "expand-more",
  label: "Expand all graphs inside, one level more",
  shortcuts: [],
  icon: IconArrowsDiagonal,
  enabled: ({ graph, store }) =>
    graph.actions.some(({ name }) => store.graphsInside.now()?.byName.has(name) ?? false),
  idle: "No action here stands for a graph.",
  run: ({ store }) => store.graphsInside.now()?.expand.expandMore(),
};

export const collapseGraphs: EditAction = {
  ...inPlace,
  name: "collapse-graphs",
  label: "Collapse all graphs inside",
  shortcuts: ["{", "Mod+Shift+ArrowUp"],
  icon: IconArrowsDiagonalMinimize2,
  enabled: ({ store }) => store.graphsInside.now()?.expand.isAnyExpanded() ?? false,
  idle: "Nothing is expanded.",
  run: ({ store }) => store.graphsInside.now()?.expand.collapseAll(),
};

/** Makes one graph without graphs inside; listed among the actions on the whole graph. */
export const flatten: EditAction = {
  ...look,
  group: "Graph",
  name: "flatten",
  label: "One graph without graphs inside",
  shortcuts: [],
  icon: IconPackageExport,
  also: "flatten sub-graph inline hierarchy levels",
  enabled: ({ graph, store }) =>
    graph.actions.some(({ name }) => store.graphsInside.now()?.byName.has(name) ?? false),
  run: (context) => context.openOverlay({ kind: "flat" }),
};

export const PANELS: readonly EditAction[] = [
  {
    ...look,
    name: "find",
    label: "Find in graph",
    shortcuts: ["Mod+f"],
    icon: IconSearch,
    also: "search robot parameter value problem",
    enabled: (context) => context.graph.actions.length > 0,
    run: (context) => context.openFind(),
  },
  {
    ...look,
    name: "outline",
    label: "Show the outline",
    shortcuts: ["o"],
    icon: IconListTree,
    also: "tree list rows",
    run: (context) => context.setPanel("outline"),
  },
  {
    ...look,
    name: "comments",
    label: "Show the comments",
    shortcuts: ["m"],
    icon: IconMessageCircle,
    also: "talk threads",
    run: (context) => context.setPanel("comments"),
  },
  {
    ...look,
    name: "courses",
    label: "Show the expected courses",
    shortcuts: [],
    icon: IconShieldCheck,
    also: "tests coverage verify",
    run: (context) => context.setPanel("courses"),
  },
];
