/**
 * Goes through the past of a document step by step, without asking anybody: from a document as it was
 * and the steps around it. Pure.
 */
import type { EditorApi } from "../../api/schema/editor";
import { mapsFrom, type Root, splitKey } from "../../graph/document-keys";
import type { Graph } from "../../graph/model";
import { type SteppedGraph, stepGraph } from "../../graph/read";

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
  /** Of all changes with `from < seq <= upto`, in order of time. */
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

  /** Takes steps that adjoin those that it has; others are of no use, and are left. */
  add(steps: readonly DocumentStep[], after: number, upto: number): void {
    if (upto < this.#from || after > this.#upto) return;
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

  /** Who set something last in each action, arrow and note, by id of the person. */
  authors(after: number, upto: number): ReadonlyMap<string, string> {
    const found = new Map<string, string>();
    for (const { seq, root, key, author } of this.#steps) {
      const owner = seq > after && seq <= upto ? ownerOf(root, key) : null;
      if (owner !== null) found.set(owner, author);
    }
    return found;
  }
}
