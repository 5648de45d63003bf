/** Which moment of the past is shown, also in the address of the page. */
import { useLocalStorage } from "@mantine/hooks";
import { useCallback, useEffect, useState } from "react";
import type { PastPlace } from "../edit-actions/editor-context";
import { pastOf, withPast } from "../edit-actions/past-links";
import type { SeenPast } from "../past/past-bar";

const WRITTEN = 300; // ms after the last step: browsers take few changes of the address in a row

/** The moment that one has asked for, which is drawn as soon as it is there. For whoever gets it. */
export class WantedPlace {
  #now: PastPlace | null;
  #listeners = new Set<() => void>();

  constructor(now: PastPlace | null) {
    this.#now = now;
  }

  subscribe = (listener: () => void): (() => void) => {
    this.#listeners.add(listener);
    return () => this.#listeners.delete(listener);
  };
  now = (): PastPlace | null => this.#now;

  set(next: PastPlace | null): void {
    this.#now = next;
    for (const listener of [...this.#listeners]) listener();
  }
}

export interface Past {
  /** Two moments stand beside each other, instead of over one another. Kept on the device. */
  readonly side: boolean;
  setSide(side: boolean): void;
  /** The moment that is drawn, or the first one that is waited for. */
  readonly place: PastPlace | null;
  readonly wanted: WantedPlace;
  /** The graph as it was then, and what differs, once it is there. */
  readonly seen: SeenPast | null;
  lookAt(place: PastPlace | null): void;
  /** Draws a moment, in one go with all that depends on where one looks. */
  show(seen: SeenPast, place: PastPlace): void;
}

interface ShownPast {
  readonly place: PastPlace | null;
  readonly seen: SeenPast | null;
}

export function usePast(): Past {
  const [{ place, seen }, setShown] = useState<ShownPast>(() => ({
    place: pastOf(window.location.search),
    seen: null,
  }));
  const [wanted] = useState(() => new WantedPlace(place));
  const [side, setSide] = useLocalStorage({
    key: "aa.compare-side",
    defaultValue: false,
    getInitialValueInEffect: false,
  });
  const lookAt = useCallback(
    (next: PastPlace | null) => {
      wanted.set(next);
      if (next === null) setShown({ place: null, seen: null });
      else setShown((now) => (now.seen === null ? { place: next, seen: null } : now));
    },
    [wanted],
  );
  const show = useCallback(
    (found: SeenPast, at: PastPlace) =>
      setShown((now) => (now.place === null ? now : { place: at, seen: found })),
    [],
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
  return { place, wanted, seen, lookAt, show, side, setSide };
}
