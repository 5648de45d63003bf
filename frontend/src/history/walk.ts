/** Graphs of the past for React: loads a document and the steps around it, and goes by them. */
import { type QueryClient, useQueryClient } from "@tanstack/react-query";
import { useEffect, useReducer, useRef, useState } from "react";
import { fetchChanges, fetchDocument } from "../api/history";
import type { EditorApi } from "../api/schema/editor";
import { mapsFrom, type Root, splitKey } from "../graph/document-keys";
import type { Graph } from "../graph/model";
import { type SteppedGraph, stepGraph } from "../graph/read";

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

/** Return the change to load next, so that steps from here need not wait; null if there is none. */
function wanted(walk: PastWalk, at: number, newest: number): number | null {
  if (walk.upto < newest && at > walk.upto - NEAR) return walk.upto + 1;
  return walk.from > 0 && at < walk.from + NEAR ? walk.from : null;
}

export interface PastGraph {
  /**
   * The graph at the moment, or the one that was shown before until it is loaded; null at first.
   */
  readonly graph: Graph | null;
  /** Set if it is the graph of the moment that was asked for. */
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

export type PastDocument = EditorApi["PastDocument"];
export type DocumentStep = EditorApi["DocumentStep"];

/** The action, arrow or note that a key is about; null of the graph itself and of comments. */
export function ownerOf(root: Root, key: string): string | null {
  if (root === "meta" || root === "comments") return null;
  if (root !== "positions") return splitKey(key).head;
  return key.startsWith("w/") ? splitKey(key.slice(2)).head : key;
}

const told = (value: unknown): unknown => value ?? undefined;

export class PastWalk {
  readonly #kept: SteppedGraph;
  /** Changes with `from < seq <= upto`, in order of time. */
  #steps: readonly DocumentStep[] = [];
  #from: number;
  #upto: number;
  #at: number;
  /** So many of the steps are in the graph. */
  #taken = 0;

  constructor(document: PastDocument, at: number) {
    this.#kept = stepGraph(mapsFrom(document));
    this.#from = at;
    this.#upto = at;
    this.#at = at;
  }

  get from(): number {
    return this.#from;
  }
  get upto(): number {
    return this.#upto;
  }

  /**
   * Takes steps that adjoin those that it has; others are of no use, and are left. So are values that were
   * overwritten at once, which no graph showed.
   */
  add(all: readonly DocumentStep[], after: number, upto: number): void {
    if (upto < this.#from || after > this.#upto) return;
    const steps = all.filter((step) => step.overwritten === undefined);
    const before = steps.filter(({ seq }) => seq <= this.#from);
    const behind = steps.filter(({ seq }) => seq > this.#upto);
    this.#steps = [...before, ...this.#steps, ...behind];
    this.#taken += before.length;
    this.#from = Math.min(this.#from, after);
    this.#upto = Math.max(this.#upto, upto);
  }

  reaches(seq: number): boolean {
    return this.#from <= seq && seq <= this.#upto;
  }

  /** The graph as it was after this change, which it reaches. */
  go(seq: number): Graph {
    for (;;) {
      const next = this.#steps[this.#taken];
      if (next === undefined || next.seq > seq) break;
      this.#kept.set(next.root, next.key, told(next.after));
      this.#taken += 1;
    }
    for (;;) {
      const last = this.#steps[this.#taken - 1];
      if (last === undefined || last.seq <= seq) break;
      this.#kept.set(last.root, last.key, told(last.before));
      this.#taken -= 1;
    }
    this.#at = seq;
    return this.#kept.graph();
  }

  /** The neighbouring change that set something which is drawn; null where it knows of none. */
  neighbour(by: 1 | -1): number | null {
    const isDrawn = ({ root }: DocumentStep) => root !== "comments";
    if (by === 1)
      return this.#steps.find((step) => step.seq > this.#at && isDrawn(step))?.seq ?? null;
    const here = this.#steps.findLast((step) => step.seq <= this.#at && isDrawn(step));
    const before = this.#steps.findLast(({ seq }) => here !== undefined && seq < here.seq);
    if (here === undefined) return null;
    return before?.seq ?? (this.#from < here.seq ? Math.max(1, here.seq - 1) : null);
  }

  /** Return who last changed each action, arrow and note, as ids of people by key. */
  authors(after: number, upto: number): ReadonlyMap<string, string> {
    const found = new Map<string, string>();
    for (const { seq, root, key, author } of this.#steps) {
      const owner = seq > after && seq <= upto ? ownerOf(root, key) : null;
      if (owner !== null) found.set(owner, author);
    }
    return found;
  }
}
