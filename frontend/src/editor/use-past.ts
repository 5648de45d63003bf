/** Which moment of the past is shown, also in the address of the page. */
import { useLocalStorage } from "@mantine/hooks";
import { startTransition, useCallback, useEffect, useState } from "react";
import type { PastPlace } from "../edit-actions/editor-context";
import { pastOf, withPast } from "../edit-actions/past-links";
import type { SeenPast } from "../past/past-bar";
import { Watched } from "../ui/watched";

const WRITTEN = 300; // ms after the last step: browsers take few changes of the address in a row

export interface Past {
  /** Two moments stand beside each other, instead of over one another. Kept on the device. */
  readonly side: boolean;
  setSide(side: boolean): void;
  /** The moment of which the page tells, or the first one that is waited for. */
  readonly place: PastPlace | null;
  /** The graph as it was then, and what differs, once it is there. What stands beside the canvas
   * follows it, as soon as there is time. */
  readonly seen: SeenPast | null;
  /** What the canvas shows, which comes first. */
  readonly drawn: Watched<SeenPast | null>;
  /** The moment that one has asked for last, which is drawn as soon as it is there. */
  readonly wanted: Watched<PastPlace | null>;
  lookAt(place: PastPlace | null): void;
  show(seen: SeenPast, place: PastPlace): void;
}

/** Where nothing else than the graph as it is can be shown. */
export const NO_PAST: Past = {
  ...{ place: null, seen: null, side: false },
  ...{ drawn: new Watched(null), wanted: new Watched(null) },
  ...{ lookAt: () => {}, show: () => {}, setSide: () => {} },
};

interface ShownPast {
  readonly place: PastPlace | null;
  readonly seen: SeenPast | null;
}

export function usePast(): Past {
  const [{ place, seen }, setShown] = useState<ShownPast>(() => ({
    place: pastOf(window.location.search),
    seen: null,
  }));
  const [wanted] = useState(() => new Watched(place));
  const [drawn] = useState(() => new Watched<SeenPast | null>(null));
  const [side, setSide] = useLocalStorage({
    key: "aa.compare-side",
    defaultValue: false,
    getInitialValueInEffect: false,
  });
  const lookAt = useCallback(
    (next: PastPlace | null) => {
      wanted.set(next);
      if (next === null) {
        setShown({ place: null, seen: null });
        drawn.set(null);
      } else setShown((now) => (now.seen === null ? { place: next, seen: null } : now));
    },
    [wanted, drawn],
  );
  const show = useCallback(
    (found: SeenPast, at: PastPlace) => {
      drawn.set(found);
      startTransition(() =>
        setShown((now) => (now.place === null ? now : { place: at, seen: found })),
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
