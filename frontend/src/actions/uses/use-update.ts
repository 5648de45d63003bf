/** Updating graphs to the parameters of an action: what is chosen, what came of it, what stood against it. */
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import {
  type ActionUse,
  type ActionUses,
  NO_RENAMES,
  refreshUses,
  type UpdatedUse,
  updateUses,
  useActionUses,
} from "../../api/documents/library";
import { refusedAt } from "../../api/documents/refused-at";
import { refreshGraphs, refreshLibrary } from "../../api/graphs";
import { errorText, Refusal } from "../../api/http";
import {
  clashes,
  keyOfRename,
  possibleRenames,
  renamesOf,
  type SuggestedRename,
  suggestedRenames,
} from "./rename-choices";

function words(error: unknown, uses: readonly ActionUse[]): string {
  const place = uses.find(({ graph }) => graph === refusedAt(error, "graph"))?.name;
  const text = place === undefined ? errorText(error) : `${place}: ${errorText(error)}`;
  const changed = error instanceof Refusal && error.details.status === 409;
  return changed
    ? `${text} Nothing was written. What would change is shown anew below.`
    : `${text} Look below at what would still change.`;
}

const toggled = (set: ReadonlySet<string>, key: string): ReadonlySet<string> => {
  const next = new Set(set);
  if (!next.delete(key)) next.add(key);
  return next;
};

/** What a person has ticked: of renames those that shall be, of graphs those that shall not. */
function useTicks(id: string) {
  const [ticked, setTicked] = useState<ReadonlySet<string>>(new Set());
  const [left, setLeft] = useState<ReadonlySet<string>>(new Set());
  // Suggestions are those without renames: one that was ticked is suggested no more.
  const plain = useActionUses(id, NO_RENAMES);
  const uses = plain.data?.uses ?? [];
  const suggested = suggestedRenames(uses);
  const possible = possibleRenames(uses, suggested);
  const all = [...suggested, ...possible];
  const renames = renamesOf(ticked, all);
  const shown = (each: SuggestedRename) => ({
    ...each,
    key: keyOfRename(each),
    ticked: ticked.has(keyOfRename(each)),
    clashes: clashes(each, ticked, all),
  });
  return {
    renames,
    suggested: suggested.map(shown),
    possible: possible.map(shown),
    tick: (key: string) => setTicked((now) => toggled(now, key)),
    /** Of several that exclude each other one, or none. */
    choose: (others: readonly string[], key: string) =>
      setTicked(
        (now) => new Set([...now].filter((each) => !others.includes(each)).concat(key || [])),
      ),
    isLeft: (graph: string) => left.has(graph),
    leave: (graph: string) => setLeft((now) => toggled(now, graph)),
  };
}

export function useUpdate(id: string) {
  const client = useQueryClient();
  const { renames, isLeft, ...ticks } = useTicks(id);
  const found = useActionUses(id, renames);
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  const [done, setDone] = useState<readonly UpdatedUse[]>([]);
  const uses = found.data?.uses ?? [];
  const chosen = uses.filter((use) => use.changed && !isLeft(use.graph));
  const update = async ({ seq }: ActionUses) => {
    setBusy(true);
    setWrong("");
    try {
      const graphs = chosen.map(({ graph, seq }) => ({ graph, seq }));
      setDone(await updateUses(id, { seq, graphs, renames }));
    } catch (error) {
      setWrong(words(error, uses));
    } finally {
      await Promise.all([refreshUses(client, id), refreshLibrary(client), refreshGraphs(client)]);
      setBusy(false);
    }
  };
  return {
    ...ticks,
    found,
    uses,
    chosen,
    isLeft,
    busy,
    wrong,
    done,
    /** What is shown is of other renames than are ticked, until the answer is there. */
    renewing: found.isPlaceholderData || found.isFetching,
    update: () => (found.data ? update(found.data) : Promise.resolve()),
  };
}

export type Update = ReturnType<typeof useUpdate>;
