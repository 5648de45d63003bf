/** Lays out a graph without any places, and writes them as one edit; a phone keeps them to itself. */
import { useEffect, useLayoutEffect, useRef, useState } from "react";
import { arrange, isUnplaced } from "../../canvas/geometry/arrange";
import { LAYOUT_PATIENCE_MS } from "../../canvas/geometry/layout";
import type { Positions } from "../../canvas/geometry/ranks";
import type { EditorContext } from "../../edit-actions/editor-context";
import { freshPlaces } from "../../edit-actions/layout";
import { placeFirst } from "../../graph/edit";
import { usePeople } from "../../sync/use-room";

/**
 * Time between pages that open the graph at once: one writes first, each later one waits this much longer. All would write the same places.
 */
const TURN_MS = 800;

interface FirstLayout {
  /** The computed places until somebody has written them; null before, and where they are not needed. */
  readonly places: Positions | null;
  readonly pending: boolean;
  readonly busy: boolean;
}

/**
 * Lays out an unplaced graph once. On a `phone` only its screen has the places, in one row or column. `onPlacing`:
 * called with whether the edit is still to come.
 */
export function useFirstLayout(
  context: EditorContext,
  arrived: boolean,
  phone: boolean,
  onPlacing: (placing: boolean) => void,
): FirstLayout {
  const unplaced = arrived && isUnplaced(context.graph);
  // If somebody has undone the layout, laying out again would leave them no way back.
  const stood = useRef(false);
  if (arrived && !unplaced && context.graph.actions.length > 0) stood.current = true;
  const loose = unplaced && !stood.current;
  const plain = useRef<Positions | null>(null);
  const [places, setPlaces] = useState<Positions | null>(null);
  const [failed, setFailed] = useState(false);
  const people = usePeople();
  const now = useRef({ context, people });
  now.current = { context, people };
  const gone = useRef(false);
  useEffect(() => {
    gone.current = false;
    return () => {
      gone.current = true;
    };
  }, []);
  useEffect(() => {
    if (!loose) return;
    let asked = true;
    let timer: ReturnType<typeof setTimeout> | undefined;
    const patience = setTimeout(() => {
      plain.current = arrange(now.current.context.graph);
      setPlaces(plain.current);
    }, LAYOUT_PATIENCE_MS);
    void freshPlaces(now.current.context.graph, undefined, !phone).then((found) => {
      clearTimeout(patience);
      if (!asked || gone.current) return;
      setPlaces(found ?? new Map());
      setFailed(found === null);
      if (found === null) return;
      if (plain.current !== null) requestAnimationFrame(() => now.current.context.view.reopen());
      if (phone) return;
      const { context, people } = now.current;
      const earlier = people.filter(({ client }) => client < context.doc.clientID).length;
      const write = () => {
        const { doc, graph, mayEdit } = now.current.context;
        if (mayEdit && isUnplaced(graph)) placeFirst(doc, found);
      };
      if (earlier === 0) write();
      else timer = setTimeout(write, earlier * TURN_MS);
    });
    return () => {
      asked = false;
      clearTimeout(timer);
      clearTimeout(patience);
    };
  }, [loose, phone]);
  const pending = loose && places === null;
  const busy = pending || (loose && places === plain.current);
  const placing = loose && !phone && context.mayEdit && !failed && context.graph.actions.length > 0;
  // Before the first paint: Start must not be enabled for a moment only.
  useLayoutEffect(() => {
    onPlacing(placing);
    return () => onPlacing(false);
  }, [placing, onPlacing]);
  return { places: loose ? places : null, pending, busy };
}
