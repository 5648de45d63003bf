/** Which moment of the past is shown, also in the address of the page. */
import { useLocalStorage } from "@mantine/hooks";
import { useCallback, useEffect, useState } from "react";
import type { PastPlace } from "../edit-actions/editor-context";
import { pastOf, withPast } from "../edit-actions/past-links";
import type { SeenPast } from "../past/past-bar";

const WRITTEN = 300; // ms after the last step: browsers take few changes of the address in a row

export interface Past {
  /** Two moments stand beside each other, instead of over one another. Kept on the device. */
  readonly side: boolean;
  setSide(side: boolean): void;
  readonly place: PastPlace | null;
  /** The graph as it was then, and what differs, once it is there. */
  readonly seen: SeenPast | null;
  lookAt(place: PastPlace | null): void;
  show(seen: SeenPast | null): void;
}

export function usePast(): Past {
  const [place, setPlace] = useState(() => pastOf(window.location.search));
  const [seen, show] = useState<SeenPast | null>(null);
  const [side, setSide] = useLocalStorage({
    key: "aa.compare-side",
    defaultValue: false,
    getInitialValueInEffect: false,
  });
  const lookAt = useCallback((next: PastPlace | null) => {
    setPlace(next);
    if (next === null) show(null);
  }, []);
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
  return { place, seen, lookAt, show, side, setSide };
}
