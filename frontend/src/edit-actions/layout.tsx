/** Laying out a graph as one edit: progress is shown when it takes longer, and it can be left. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { estimatedSizes } from "../canvas/geometry/arrange";
import { LayoutLeft, layOut } from "../canvas/geometry/layout";
import type { Positions, Sizes } from "../canvas/geometry/ranks";
import { asOneEdit, moveActions, setDirection } from "../graph/edit";
import { changeNote, notesOf } from "../graph/edit/notes";
import { straighten } from "../graph/edit/waypoints";
import type { Direction, Graph, Key } from "../graph/model";
import { announcer } from "../ui/announcer";
import type { EditorContext } from "./editor-context";

const PATIENCE_MS = 1_000;
const NOTICE = "layout";

let running: AbortController | null = null;

function sayNothingArranged(error: unknown): void {
  notifications.show({
    color: "red",
    title: "Nothing was arranged",
    message: `The layout could not be computed (${error instanceof Error ? error.message : String(error)}).`,
    autoClose: 12_000,
  });
}

/** Loads, with the first layout, the code that moves notes with the things beside them. */
const followNotes = () =>
  import("../canvas/geometry/follow-notes").catch((error: unknown) => {
    sayNothingArranged(error);
    return null;
  });

/**
 * Fresh places, with a notice that has a way out when it takes long; null when left or failed. `wraps`: a long graph
 * has several rows.
 */
export async function freshPlaces(
  graph: Graph,
  sizes: Sizes = estimatedSizes(graph),
  wraps = true,
): Promise<Positions | null> {
  running?.abort();
  const mine = new AbortController();
  running = mine;
  const timer = setTimeout(() => {
    notifications.show({
      id: NOTICE,
      loading: true,
      autoClose: false,
      withCloseButton: false,
      title: `Arranging ${graph.actions.length} actions …`,
      message: (
        <Button size="compact-sm" variant="default" onClick={() => mine.abort()}>
          Leave them as they are
        </Button>
      ),
    });
  }, PATIENCE_MS);
  try {
    return await layOut(graph, sizes, mine.signal, wraps);
  } catch (error) {
    if (!(error instanceof LayoutLeft)) sayNothingArranged(error);
    return null;
  } finally {
    clearTimeout(timer);
    if (running === mine) {
      running = null;
      notifications.hide(NOTICE);
    }
  }
}

/** Returns the measured sizes, or estimated ones where cards will be drawn otherwise in the other direction. */
function sizesFor(context: EditorContext, graph: Graph): Sizes {
  const measured = context.sizes();
  if (graph.direction !== context.graph.direction) return estimatedSizes(graph);
  return new Map([...estimatedSizes(graph), ...measured]);
}

/** Lays out the whole graph anew, in this direction; one step of undo. */
export async function layOutGraph(
  context: EditorContext,
  direction: Direction = context.graph.direction,
): Promise<void> {
  const { doc } = context;
  const before = context.graph;
  const graph: Graph = { ...before, direction };
  const [old, sizes] = [new Map(context.positions()), sizesFor(context, graph)];
  const following = followNotes();
  const places = await freshPlaces(graph, sizes);
  const follow = await following;
  if (places === null || follow === null) return;
  const notes = follow.notesAfter(notesOf(before), old, places, sizes, direction);
  asOneEdit(doc, () => {
    setDirection(doc, direction);
    straighten(doc, context.graph.relations);
    moveActions(doc, places);
    for (const [key, change] of notes) changeNote(doc, key, change);
  });
  announcer.say(`${graph.actions.length} actions arranged`);
  requestAnimationFrame(() => context.view.open());
}

/**
 * Computes fresh places (px) for some of the actions; the upper left corner of them all stays where it is. Null when
 * the person left or it failed.
 */
export async function layOutSome(
  context: EditorContext,
  keys: ReadonlySet<Key>,
): Promise<Positions | null> {
  const { graph } = context;
  const part: Graph = {
    ...graph,
    actions: graph.actions.filter(({ key }) => keys.has(key)),
    relations: graph.relations.filter(({ parent, child }) => keys.has(parent) && keys.has(child)),
  };
  const old = context.positions();
  const places = await freshPlaces(part, sizesFor(context, part));
  if (places === null) return null;
  const [from, to] = [corner(places, keys), corner(old, keys)];
  return new Map(
    [...keys].flatMap((key) => {
      const at = places.get(key);
      return at ? [[key, [at[0] - from[0] + to[0], at[1] - from[1] + to[1]] as const]] : [];
    }),
  );
}

function corner(places: ReadonlyMap<Key, readonly [number, number]>, keys: ReadonlySet<Key>) {
  const known = [...keys].flatMap((key) => {
    const at = places.get(key);
    return at ? [at] : [];
  });
  return [Math.min(...known.map(([x]) => x)), Math.min(...known.map(([, y]) => y))] as const;
}
