/** Lets the rest of the page come once a graph is on screen. */
import { useEffect } from "react";
import { firstViewIsThere } from "../../clock/first-view";
import { useLinkPart } from "../../sync/use-room";

/** Ends the first view when the cards or rows are on screen, or cannot come now. `drawn`: they are in the document. */
export function useFirstViewEnd(drawn: boolean): void {
  const fails = useLinkPart(({ state }) => state === "offline" || state === "refused");
  useEffect(() => {
    if (fails) firstViewIsThere();
  }, [fails]);
  useEffect(() => {
    if (!drawn) return;
    let frame = requestAnimationFrame(() => {
      frame = requestAnimationFrame(firstViewIsThere);
    });
    return () => cancelAnimationFrame(frame);
  }, [drawn]);
}
