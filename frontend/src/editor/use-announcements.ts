/** Announces changes of others and the states of a run to screen readers. */
import { useEffect, useRef } from "react";
import type * as Y from "yjs";
import { endsOf, rootOf, splitKey } from "../graph/document-keys";
import type { Graph, Key } from "../graph/model";
import { endName } from "../graph/relation-words";
import type { Progress } from "../status/progress";
import { useRoom } from "../sync/use-room";
import { announcer } from "../ui/announcer";
import { isolated } from "../words/isolated";

/** Return the names of actions, and of the ends of arrows, that a transaction has changed. */
function touched(graph: Graph, doc: Y.Doc, transaction: Y.Transaction): string[] {
  const names = new Set<string>();
  for (const [type, keys] of transaction.changed) {
    const relations = (type as unknown) === rootOf(doc, "relations");
    if (!relations && (type as unknown) !== rootOf(doc, "actions")) continue;
    for (const key of keys) {
      const { head } = splitKey(key ?? "");
      const ends = relations ? endsOf(head) : null;
      if (relations && ends === null) continue;
      names.add(
        ends
          ? `${isolated(endName(graph, ends.parent))} to ${isolated(endName(graph, ends.child))}`
          : endName(graph, head),
      );
    }
  }
  return [...names];
}

/** Announces changes of others. `begun`: the graph has arrived; its first contents are not announced. */
export function useRemoteEditAnnouncements(graph: Graph, begun: boolean): void {
  const { doc, presence } = useRoom();
  const latest = useRef(graph);
  latest.current = graph;
  useEffect(() => {
    if (!begun) return;
    const onEnd = (transaction: Y.Transaction) => {
      if (transaction.local) return;
      const names = touched(latest.current, doc, transaction);
      if (names.length === 0) return;
      const people = new Set(presence.people().map(({ name }) => name || "a guest"));
      const [only = "Somebody"] = people;
      const who = people.size === 1 ? only : "Somebody";
      const what = names.length > 3 ? `${names.length} things` : names.map(isolated).join(", ");
      announcer.say(`${isolated(who)} changed ${what}`);
    };
    doc.on("afterTransaction", onEnd);
    return () => doc.off("afterTransaction", onEnd);
  }, [doc, presence, begun]);
}

/**
 * Return the announcement of an action's state. If the graph has no such action, the name in the
 * run is used.
 */
export function runAnnouncement(graph: Graph, key: Key, { name, word }: Progress): string {
  const isDrawn = graph.actions.some((action) => action.key === key);
  return `${isDrawn || name === undefined ? endName(graph, key) : name}: ${word}`;
}

/** Announces every action whose state in a run changes. */
export function useRunAnnouncements(graph: Graph, progress: ReadonlyMap<Key, Progress>): void {
  const before = useRef(progress);
  useEffect(() => {
    const old = before.current;
    before.current = progress;
    if (old === progress) return;
    for (const [key, now] of progress) {
      if (old.get(key)?.word !== now.word) announcer.say(runAnnouncement(graph, key, now));
    }
  }, [graph, progress]);
}
