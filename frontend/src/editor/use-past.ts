/** State of the moment of the past that is shown, which the address of the page contains, too. */
import { startTransition, useCallback, useEffect, useState } from "react";
import type { PastPlace } from "../edit-actions/editor-context";
import { pastOf, withPast } from "../edit-actions/graph-links";
import type { SeenPast } from "../history/past-bar";
import { useKept } from "../ui/hooks";
import { Watched } from "../ui/watched";

const WRITTEN = 300; // ms after the last step, since browsers limit changes of the address

export interface Past {
  /** Two moments are shown side by side instead of one over the other. Kept on this device. */
  readonly side: boolean;
  setSide(side: boolean): void;
  /** The moment that panels show, or the first one while it loads. */
  readonly place: PastPlace | null;
  /** The graph of that moment and its differences, once loaded. Panels follow it when there is time. */
  readonly seen: SeenPast | null;
  /** The moment that the canvas draws; it is updated first. */
  readonly drawn: Watched<SeenPast | null>;
  /** The moment asked for last, drawn as soon as it is loaded. */
  readonly wanted: Watched<PastPlace | null>;
  lookAt(place: PastPlace | null): void;
  show(seen: SeenPast, place: PastPlace): void;
}

/** The state of a page that cannot show the past. */
export const NO_PAST: Past = {
  ...{ place: null, seen: null, side: false },
  ...{ drawn: new Watched(null), wanted: new Watched(null) },
  ...{ lookAt: () => {}, show: () => {}, setSide: () => {} },
};

interface PastState {
  readonly place: PastPlace | null;
  readonly seen: SeenPast | null;
}

/** Return the moment of the past that is shown, and keep it in the address. */
export function usePast(): Past {
  const [{ place, seen }, setState] = useState<PastState>(() => ({
    place: pastOf(window.location.search),
    seen: null,
  }));
  const [wanted] = useState(() => new Watched(place));
  const [drawn] = useState(() => new Watched<SeenPast | null>(null));
  const [side, setSide] = useKept("aa.compare-side", false);
  const lookAt = useCallback(
    (next: PastPlace | null) => {
      wanted.set(next);
      if (next === null) {
        setState({ place: null, seen: null });
        drawn.set(null);
      } else setState((now) => (now.seen === null ? { place: next, seen: null } : now));
    },
    [wanted, drawn],
  );
  const show = useCallback(
    (found: SeenPast, at: PastPlace) => {
      drawn.set(found);
      startTransition(() =>
        setState((now) => (now.place === null ? now : { place: at, seen: found })),
      );
    },
    [drawn],
  );
  useEffect(() => {
    const { pathname } = window.location;
    const timer = setTimeout(() => {
      const { location, history } = window;
      const search = withPast(location.search, place);
      if (location.pathname !== pathname || search === location.search) return;
      history.replaceState(history.state, "", `${pathname}${search}${location.hash}`);
    }, WRITTEN);
    return () => clearTimeout(timer);
  }, [place]);
  return { place, seen, drawn, wanted, lookAt, show, side, setSide };
}
