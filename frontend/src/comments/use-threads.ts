/** The threads of the open graph, kept in step with the document. */
import { useEffect, useMemo, useRef, useSyncExternalStore } from "react";
import { useEditorStore } from "../canvas/editor-store";
import { rootOf } from "../graph/document-keys";
import { openThreadCounts, readThreads, type Thread } from "../graph/edit/comments";
import { useRoom } from "../sync/use-room";

const NONE: readonly Thread[] = [];

export function useThreads(): readonly Thread[] {
  const { doc } = useRoom();
  const read = useRef<readonly Thread[]>(NONE);
  const source = useMemo(() => {
    const map = rootOf(doc, "comments");
    read.current = readThreads(map.entries());
    return {
      now: () => read.current,
      subscribe(listener: () => void) {
        const onChange = () => {
          read.current = readThreads(map.entries());
          listener();
        };
        map.observe(onChange);
        return () => map.unobserve(onChange);
      },
    };
  }, [doc]);
  return useSyncExternalStore(source.subscribe, source.now);
}

/** Cards show how many open threads there are about them. */
export function useOpenThreadsOnCards(threads: readonly Thread[]): void {
  const { openThreads } = useEditorStore();
  useEffect(() => openThreads.set(openThreadCounts(threads)), [openThreads, threads]);
}
