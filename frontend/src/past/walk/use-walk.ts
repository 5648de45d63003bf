/** Graphs of the past for React: loads a document and the steps around it, and goes by them. */
import { type QueryClient, useQueryClient } from "@tanstack/react-query";
import { useEffect, useReducer, useRef, useState } from "react";
import { fetchChanges, fetchDocument } from "../../api/documents/history";
import type { Graph } from "../../graph/model";
import { PastWalk } from "./walk";

const PIECE = 200; // changes that are loaded together
const NEAR = 60; // changes from the end of what is loaded, from which on the next piece comes
const MOST_STEPS = 5_000; // keys in one answer

/** The piece in which a change is, as far as there is one: pieces stay the same once they are whole. */
function pieceOf(seq: number, newest: number): { after: number; upto: number } {
  const after = Math.floor((seq - 1) / PIECE) * PIECE;
  return { after, upto: Math.min(after + PIECE, newest) };
}

/** Loads one piece into a walk; answers nothing where a piece has more than one answer can hold. */
async function loadPiece(
  client: QueryClient,
  id: string,
  walk: PastWalk,
  seq: number,
  newest: number,
) {
  const { after, upto } = pieceOf(seq, newest);
  const steps = await client.fetchQuery({
    queryKey: ["past", id, "changes", after, upto],
    queryFn: ({ signal }) => fetchChanges(id, after, upto, signal),
    staleTime: Number.POSITIVE_INFINITY,
  });
  if (steps.length < MOST_STEPS) walk.add(steps, after, upto);
}

/** Which change is to be loaded next, so that steps from here on need not wait; null: none. */
function wanted(walk: PastWalk, at: number, newest: number): number | null {
  if (walk.upto < newest && at > walk.upto - NEAR) return walk.upto + 1;
  return walk.from > 0 && at < walk.from + NEAR ? walk.from : null;
}

export interface PastGraph {
  /** As it was, or meanwhile what was shown before; null while there is nothing. */
  readonly graph: Graph | null;
  /** Whether it is the graph of the moment that was asked for. */
  readonly here: boolean;
  readonly walk: PastWalk | null;
  readonly error: Error | null;
}

/** The graph as it was after the change `at`; null: none is wanted. */
export function usePastGraph(id: string, at: number | null, newest: number): PastGraph {
  const client = useQueryClient();
  const [walk, setWalk] = useState<PastWalk | null>(null);
  const [error, setError] = useState<Error | null>(null);
  const [loaded, more] = useReducer((count: number) => count + 1, 0);
  const last = useRef<Graph | null>(null);
  const reached = at !== null && walk?.reaches(at) === true;
  useEffect(() => {
    if (at === null || reached) return;
    let asked = true;
    const load = async () => {
      const document = await client.fetchQuery({
        queryKey: ["past", id, "document", at],
        queryFn: ({ signal }) => fetchDocument(id, at, signal),
        staleTime: Number.POSITIVE_INFINITY,
      });
      if (asked) setWalk(new PastWalk(document, at));
      if (asked) setError(null);
    };
    load().catch((cause: unknown) => asked && setError(cause as Error));
    return () => {
      asked = false;
    };
  }, [client, id, at, reached]);
  const next = walk === null || at === null || !reached ? null : wanted(walk, at, newest);
  // biome-ignore lint/correctness/useExhaustiveDependencies: `loaded` asks for the piece after it
  useEffect(() => {
    if (walk === null || next === null) return;
    let asked = true;
    const before = [walk.from, walk.upto].join();
    const done = () => asked && before !== [walk.from, walk.upto].join() && more();
    // Without steps each moment is asked for by itself.
    loadPiece(client, id, walk, next, newest).then(done, () => {});
    return () => {
      asked = false;
    };
  }, [client, id, walk, next, newest, loaded]);
  if (reached) last.current = walk.go(at);
  return { graph: at === null ? null : last.current, here: reached, walk, error };
}
