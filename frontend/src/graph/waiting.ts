/**
 * Decides for which arrows an action, and the end of the graph, has to wait, so that what is drawn ends.
 *
 * The engine starts an action when every arrow into it that is *required* has reported, and starts
 * it again with each later report. Where two arrows into one action never report in one run, as
 * after a decision, neither may be waited for; where both do, as after a fork, both must be. The
 * arrows alone tell which it is: this module follows them from the entry, and keeps which arrows
 * that have not reported yet may exist at the same time (*concurrent*). An arrow back is no part of
 * the first lap, so nothing waits for it. Pure.
 */

import { relationId } from "./document-keys";
import { ENTRY, EXIT, type Graph, type Key, PRECONDITIONS, type Relation } from "./model";

/** Says for each arrow, by its id, whether its child has to wait for it. Arrows without an entry are not judged. */
export type Waits = ReadonlyMap<string, boolean>;

/** One outcome after which an arrow starts its child. */
interface Start {
  readonly arrow: Arrow;
  /** Its number among all starts: its bit in a row. */
  readonly bit: number;
}

interface Arrow {
  readonly id: string;
  readonly parent: Key;
  readonly child: Key;
  /** The outcomes of the parent after which the child starts. */
  readonly outcomes: readonly string[];
  /** True if it leads back to an action that has begun before its parent. */
  readonly back: boolean;
}

/** Returns which arrows have to be waited for, as far as the arrows of this graph tell. */
export function waitsOf(graph: Graph): Waits {
  const waits = new Map<string, boolean>();
  const { order, out } = inOrder(graph);
  const reached = new Set(order);
  for (const relation of graph.relations) {
    const { parent, child } = relation;
    // What nothing leads to yet never reports.
    const isIdle = !reached.has(parent) && reached.has(child);
    if (parent !== ENTRY && (isIdle || onlyInterrupts(relation))) {
      waits.set(relationId(relation), false);
    }
  }
  const runsBeside = graph.actions.some(({ type }) => type === "spontaneous") || multiplies(out);
  new FirstLap(out, waits, runsBeside).follow(order);
  return waits;
}

/** True if the arrow stops or pauses its child, and never starts it. */
function onlyInterrupts({ conditions }: Relation): boolean {
  const said = PRECONDITIONS.map((outcome) => conditions[outcome]);
  return said.some((r) => r === "stop" || r === "pause") && !said.some(starts);
}

const starts = (response: string): boolean => response === "run" || response === "bypass";

/** Returns the actions that the entry leads to, parents first, and the arrows out of each, by their parents. */
function inOrder(graph: Graph): { order: readonly Key[]; out: ReadonlyMap<Key, readonly Arrow[]> } {
  const leading = new Map<Key, Relation[]>();
  for (const relation of [...graph.relations].sort((a, b) => a.parentOrder - b.parentOrder)) {
    const { parent, conditions } = relation;
    if (PRECONDITIONS.some((outcome) => starts(conditions[outcome]))) {
      leading.set(parent, [...(leading.get(parent) ?? []), relation]);
    }
  }
  const out = new Map<Key, Arrow[]>();
  const ended: Key[] = [];
  const begun = new Set<Key>([ENTRY]);
  const open = new Set<Key>([ENTRY]);
  const path = [{ key: ENTRY as Key, left: leading.get(ENTRY)?.values() }];
  for (let top = path.at(-1); top !== undefined; top = path.at(-1)) {
    const next = top.left?.next();
    if (next === undefined || next.done) {
      path.pop();
      open.delete(top.key);
      ended.push(top.key);
      continue;
    }
    const { child, conditions } = next.value;
    const outcomes = PRECONDITIONS.filter((outcome) => starts(conditions[outcome]));
    const arrow = {
      id: relationId(next.value),
      parent: top.key,
      child,
      outcomes,
      back: open.has(child),
    };
    out.set(top.key, [...(out.get(top.key) ?? []), arrow]);
    if (begun.has(child)) continue;
    begun.add(child);
    open.add(child);
    path.push({ key: child, left: leading.get(child)?.values() });
  }
  return { order: ended.reverse(), out };
}

/** True if one outcome leads both back and elsewhere: each lap then adds something that runs beside the next one. */
function multiplies(out: ReadonlyMap<Key, readonly Arrow[]>): boolean {
  return [...out.values()].some((arrows) =>
    arrows.some(
      (arrow) =>
        arrow.back &&
        arrows.some(
          (other) => other !== arrow && other.outcomes.some((o) => arrow.outcomes.includes(o)),
        ),
    ),
  );
}

/** Follows a graph from its entry through the first lap, and notes what each action has to wait for. */
class FirstLap {
  /** The starts that lead to each action and have been made possible. */
  private readonly arriving = new Map<Key, Start[]>();
  /** By start: the bits of all starts that may exist beside it. */
  private readonly rows = new Map<number, Uint32Array>();
  private readonly known: Start[] = [];
  private readonly words: number;
  /** The actions that begin when every action ends with on_true. */
  private readonly usual = new Set<Key>([ENTRY]);

  private readonly out: ReadonlyMap<Key, readonly Arrow[]>;
  private readonly waits: Map<string, boolean>;
  /** True if something may run beside whatever else the arrows say. */
  private readonly runsBeside: boolean;

  constructor(
    out: ReadonlyMap<Key, readonly Arrow[]>,
    waits: Map<string, boolean>,
    runsBeside: boolean,
  ) {
    this.out = out;
    this.waits = waits;
    this.runsBeside = runsBeside;
    const starts = [...out.values()].flat().reduce((sum, { outcomes }) => sum + outcomes.length, 0);
    this.words = Math.ceil(starts / 32);
  }

  follow(order: readonly Key[]): void {
    for (const arrows of this.out.values()) {
      for (const { id, back } of arrows) if (back) this.waits.set(id, false);
    }
    for (const key of order) this.leave(key, this.enter(key));
  }

  /** Judges the arrows into an action, and returns what may exist beside it once it has begun. */
  private enter(key: Key): Uint32Array {
    const arriving = this.arriving.get(key) ?? [];
    const arrows = [...new Set(arriving.map(({ arrow }) => arrow))];
    const of = (arrow: Arrow | undefined) => arriving.filter((start) => start.arrow === arrow);
    const rows = arrows.map((arrow) => this.united(of(arrow).map(({ bit }) => this.rows.get(bit))));
    const isBeside = arrows.some((_, one) =>
      arrows.slice(0, one).some((other) => of(other).some(({ bit }) => has(rows[one], bit))),
    );
    const whenTrue = arrows.filter(({ outcomes }) => outcomes.includes("on_true"));
    const usual = whenTrue.filter(({ parent }) => this.usual.has(parent));
    if (usual.length > 0) this.usual.add(key);
    // Where some come together and others instead of them, no choice is right for all outcomes: it
    // is right when all goes well, and otherwise nothing begins or ends too early.
    const together = [usual, whenTrue].find(({ length }) => length > 0) ?? arrows;
    const mayAll = isBeside || arrows.length === 1 || (this.runsBeside && key === EXIT);
    const waitedFor = mayAll ? together : [];
    for (const arrow of arrows) {
      if (arrow.parent !== ENTRY) this.waits.set(arrow.id, waitedFor.includes(arrow));
    }
    for (const { bit } of arriving) this.rows.delete(bit);
    if (waitedFor.length === 0) return this.united(rows);
    return this.common(rows.filter((_, i) => waitedFor.includes(arrows[i] as Arrow)));
  }

  /** Adds what may start after an action, of which `beside` may exist at the same time. */
  private leave(key: Key, beside: Uint32Array): void {
    const arrows = (this.out.get(key) ?? []).filter(({ back }) => !back);
    for (const outcome of PRECONDITIONS) {
      const together: Start[] = [];
      for (const arrow of arrows) {
        if (!arrow.outcomes.includes(outcome)) continue;
        const start = { arrow, bit: this.known.length };
        this.known.push(start);
        const row = beside.slice();
        for (const { bit } of together) add(row, bit);
        for (const bit of bits(row)) {
          const other = this.rows.get(bit);
          if (other) add(other, start.bit);
        }
        this.rows.set(start.bit, row);
        together.push(start);
        this.arriving.set(arrow.child, [...(this.arriving.get(arrow.child) ?? []), start]);
      }
    }
  }

  private united(rows: readonly (Uint32Array | undefined)[]): Uint32Array {
    return new Uint32Array(this.words).map((_, i) =>
      rows.reduce((all, row) => all | (row?.[i] ?? 0), 0),
    );
  }

  private common(rows: readonly Uint32Array[]): Uint32Array {
    return new Uint32Array(this.words).map((_, i) =>
      rows.reduce((all, row) => all & (row[i] ?? 0), -1),
    );
  }
}

const has = (row: Uint32Array | undefined, bit: number): boolean =>
  (((row?.[bit >>> 5] ?? 0) >>> (bit & 31)) & 1) === 1;

function add(row: Uint32Array, bit: number): void {
  row[bit >>> 5] = (row[bit >>> 5] ?? 0) | (1 << (bit & 31));
}

function* bits(row: Uint32Array): Generator<number> {
  for (const [i, word] of row.entries()) {
    for (let left = word; left !== 0; left &= left - 1)
      yield i * 32 + 31 - Math.clz32(left & -left);
  }
}
