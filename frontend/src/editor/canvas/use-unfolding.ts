/** What leads to something in a folded frame unfolds it, and so does putting something there. */
import { useEffect, useRef } from "react";
import { type Folding, hiding } from "../../canvas/folding/folding";
import type { Positions, Sizes } from "../../canvas/geometry/arrange";
import type { EditorContext } from "../../edit-actions/editor-context";
import type { Key } from "../../graph/model";
import { useStableCallback } from "../../ui/hooks/use-stable-callback";

interface FoldedCanvas {
  readonly folding: Folding | null;
  readonly places: Positions;
  readonly sizes: Sizes;
}

/** Unfolds the frames that hide any of these. */
export function useUnfolding(context: EditorContext, canvas: FoldedCanvas) {
  const { graph, folded, fold, selection } = context;
  const { folding, places, sizes } = canvas;
  const unfoldRound = useStableCallback((keys: readonly Key[]) => {
    if (folding === null) return;
    const frames = hiding(graph, folded, keys, places, sizes);
    if (frames.length > 0) fold(frames, false);
  });
  // What a person has chosen and adds or moves into a block would be gone from under their hands.
  const before = useRef({ folded, folding });
  useEffect(() => {
    const was = before.current;
    before.current = { folded, folding };
    if (folding === null || was.folded !== folded) return;
    const isGone = (key: string) => folding.blockOf.has(key) && !was.folding?.blockOf.has(key);
    unfoldRound([...selection].filter(isGone));
  }, [folded, folding, selection, unfoldRound]);
  return { blockOf: folding?.blockOf, unfoldRound };
}
