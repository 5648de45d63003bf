/**
 * Undo and redo of the person's own edits in a document that others change, too.
 *
 * A step notes for each key what it found and what it left, and taking it back writes plain values.
 * The undo manager of Yjs revives items instead: where somebody else's value stands beside the item,
 * it revives nothing, and the key is gone although both people had set it. Here three rules hold:
 *
 * - A key is written only while it is as the step left it. What somebody else set, or erased, after
 *   the step stays.
 * - Where somebody else set the key at the same time and lost, their value comes back and not the one
 *   before. Where that value is not known any more, a key is not removed that they had added, too.
 * - An action that the step added is taken away whole, or not at all when somebody else has put
 *   something into it or drawn an arrow to it.
 */

import { ObservableV2 } from "lib0/observable";
import * as Y from "yjs";
import { endsOf, type Maps, ROOTS, type Root, rootOf, splitKey } from "../document-keys";
import { isEqual } from "../values";

/** The content of a key for a while. Two of them are the same object only if the key was not set in between. */
interface KeyState {
  /** Null where the key was missing. */
  readonly held: { readonly value: unknown } | null;
}

interface KeyStep {
  readonly root: Root;
  readonly key: string;
  /** The state that undo restores. */
  back: KeyState;
  /** The state after the step. */
  readonly left: KeyState;
}

export class UndoStep {
  /** Data that the maker of the step keeps with it. */
  readonly meta = new Map<unknown, unknown>();
  readonly keys = new Map<string, KeyStep>();
}

interface StepEvent {
  readonly stackItem: UndoStep;
  /** The stack that holds it now. */
  readonly type: "undo" | "redo";
}

const placeOf = (root: Root, key: string) => `${root} ${key}`;
const heldIn = (map: Pick<ReadonlyMap<string, unknown>, "get" | "has">, key: string) =>
  map.has(key) ? { value: map.get(key) } : null;
const isGone = ({ held }: KeyState) => held === null;

export class UndoHistory extends ObservableV2<{
  "stack-item-added": (event: StepEvent) => void;
  "stack-item-updated": (event: StepEvent) => void;
  "stack-item-popped": (event: StepEvent) => void;
}> {
  /** Edits that follow one another faster than this, ms, are one step. */
  captureTimeout = 0;
  readonly undoStack: UndoStep[] = [];
  readonly redoStack: UndoStep[] = [];
  private readonly doc: Y.Doc;
  private readonly own: unknown;
  /** The present states of the keys of all steps. */
  private readonly states = new Map<string, KeyState>();
  /** The states before the newest changes that others, or the server, made of these keys. */
  private readonly earlier = new Map<string, KeyState>();
  private made: UndoStep | null = null;
  private lastChange = 0;
  private readonly observers: readonly (readonly [Root, (event: Y.YMapEvent<unknown>) => void])[];

  /** `own`: the origin of the person's edits. */
  constructor(doc: Y.Doc, own: unknown) {
    super();
    this.doc = doc;
    this.own = own;
    this.observers = ROOTS.map((root) => [root, (event) => this.see(root, event)] as const);
    for (const [root, see] of this.observers) rootOf(doc, root).observe(see);
    doc.on("afterTransaction", this.onTransaction);
  }

  canUndo(): boolean {
    return this.undoStack.length > 0;
  }

  canRedo(): boolean {
    return this.redoStack.length > 0;
  }

  /** Undoes the newest step of which something is left. Returns it; null when there is none. */
  undo(): UndoStep | null {
    return this.takeBack(this.undoStack, this.redoStack, "undo");
  }

  /** Makes the step again that was undone last. */
  redo(): UndoStep | null {
    return this.takeBack(this.redoStack, this.undoStack, "redo");
  }

  /**
   * Records as a step an edit that the server made for the person, such as a restore. `before` and `after`: the
   * document around that edit. A key that is not as the edit left it is no part of the step.
   */
  adopt(before: Maps, after: Maps): void {
    const step = new UndoStep();
    for (const root of ROOTS) {
      for (const key of new Set([...before[root].keys(), ...after[root].keys()])) {
        const [found, made] = [heldIn(before[root], key), heldIn(after[root], key)];
        const now = this.stateNow(root, key);
        if (isEqual(found, made) || !isEqual(now.held, made)) continue;
        const place = placeOf(root, key);
        const left = this.states.get(place) ?? now;
        const earlier = this.earlier.get(place);
        // The state of the step before, so that it can be undone, too.
        const back = earlier && isEqual(earlier.held, found) ? earlier : { held: found };
        this.states.set(place, left);
        step.keys.set(place, { root, key, back, left });
      }
    }
    if (step.keys.size === 0) return;
    this.redoStack.length = 0;
    this.lastChange = 0;
    this.undoStack.push(step);
    this.emit("stack-item-added", [{ stackItem: step, type: "undo" }]);
  }

  override destroy(): void {
    for (const [root, see] of this.observers) rootOf(this.doc, root).unobserve(see);
    this.doc.off("afterTransaction", this.onTransaction);
    super.destroy();
  }

  // -- what happens ---------------------------------------------------------------------------

  private see(root: Root, event: Y.YMapEvent<unknown>): void {
    const { transaction } = event;
    if (transaction.origin === this) return;
    if (transaction.origin === this.own) this.note(root, event);
    else {
      for (const key of event.keysChanged) {
        if (this.states.has(placeOf(root, key))) this.heed(root, key, event);
      }
    }
  }

  /** Records an edit of the person as a step. */
  private note(root: Root, event: Y.YMapEvent<unknown>): void {
    for (const [key, { action, oldValue }] of event.changes.keys) {
      const place = placeOf(root, key);
      if (oldValue instanceof Y.AbstractType) continue; // no page of ours writes one
      const found = { held: action === "add" ? null : { value: oldValue } };
      const back = this.states.get(place) ?? found;
      const left = this.stateNow(root, key);
      this.states.set(place, left);
      this.made ??= new UndoStep();
      this.made.keys.set(place, { root, key, back, left });
    }
  }

  /**
   * Takes note that somebody else set or erased a key of some step, or set it at the same time as the person and
   * lost.
   */
  private heed(root: Root, key: string, event: Y.YMapEvent<unknown>): void {
    const place = placeOf(root, key);
    if (event.changes.keys.has(key)) {
      const state = this.states.get(place);
      if (state !== undefined) this.earlier.set(place, state);
      this.states.set(place, this.stateNow(root, key));
      return;
    }
    const lost = lostValue(event, key);
    if (lost === null) return;
    const theirs: KeyState | null = lost.held && { held: lost.held };
    for (const stack of [this.undoStack, this.redoStack]) {
      for (const each of stack.flatMap((step) => step.keys.get(place) ?? [])) {
        if (isGone(each.back)) each.back = theirs ?? { held: each.left.held };
        else if (stack === this.undoStack && theirs !== null && lost.isNewest) each.back = theirs;
      }
    }
  }

  private stateNow(root: Root, key: string): KeyState {
    return { held: heldIn(rootOf(this.doc, root), key) };
  }

  private readonly onTransaction = (): void => {
    const step = this.made;
    this.made = null;
    if (step === null) return;
    this.redoStack.length = 0;
    const now = Date.now();
    const last = this.undoStack.at(-1);
    const joins = this.lastChange > 0 && now - this.lastChange < this.captureTimeout;
    this.lastChange = now;
    if (joins && last !== undefined) {
      for (const [place, each] of step.keys) {
        const before = last.keys.get(place);
        const back = before?.left === each.back ? before.back : each.back;
        last.keys.set(place, { ...each, back });
      }
      this.emit("stack-item-updated", [{ stackItem: last, type: "undo" }]);
      return;
    }
    this.undoStack.push(step);
    this.emit("stack-item-added", [{ stackItem: step, type: "undo" }]);
  };

  // -- back and forth -------------------------------------------------------------------------

  private takeBack(from: UndoStep[], to: UndoStep[], type: "undo" | "redo"): UndoStep | null {
    this.lastChange = 0;
    for (let step = from.pop(); step !== undefined; step = from.pop()) {
      const reverse = new UndoStep();
      const changed = this.doc.transact(() => this.write(step, reverse), this);
      if (reverse.keys.size > 0) {
        to.push(reverse);
        const other = type === "undo" ? "redo" : "undo";
        this.emit("stack-item-added", [{ stackItem: reverse, type: other }]);
      }
      if (!changed) continue;
      this.emit("stack-item-popped", [{ stackItem: step, type }]);
      return step;
    }
    return null;
  }

  /** Writes what the step goes back to, and into `reverse` how to come here again. */
  private write(step: UndoStep, reverse: UndoStep): boolean {
    const mine = [...step.keys].filter(([place, { left }]) => this.states.get(place) === left);
    const shared = this.sharedActions(new Map(mine));
    let changed = false;
    for (const [place, { root, key, back, left }] of mine) {
      if (shared.size > 0 && shared.has(actionOf(root, key))) continue;
      const map = rootOf(this.doc, root);
      if (!isEqual(back.held, left.held)) {
        if (back.held === null) map.delete(key);
        else map.set(key, back.held.value);
        changed = true;
      }
      this.states.set(place, back);
      reverse.keys.set(place, { root, key, back: left, left: back });
    }
    return changed;
  }

  /**
   * Returns the actions that these steps would remove although somebody else put something into them or drew an
   * arrow to them.
   */
  private sharedActions(steps: ReadonlyMap<string, KeyStep>): ReadonlySet<string> {
    const going = new Set<string>();
    for (const { root, key, back, left } of steps.values()) {
      if (root !== "actions" || splitKey(key).rest !== "") continue;
      if (isGone(back) && !isGone(left)) going.add(key);
    }
    const shared = new Set<string>();
    if (going.size === 0) return shared;
    const goes = (root: Root, key: string) => {
      const step = steps.get(placeOf(root, key));
      return step !== undefined && isGone(step.back);
    };
    for (const key of rootOf(this.doc, "actions").keys()) {
      const { head } = splitKey(key);
      if (going.has(head) && !goes("actions", key)) shared.add(head);
    }
    for (const key of rootOf(this.doc, "relations").keys()) {
      const ends = endsOf(splitKey(key).head);
      if (ends === null || goes("relations", key)) continue;
      for (const end of [ends.parent, ends.child]) if (going.has(end)) shared.add(end);
    }
    return shared;
  }
}

/** The action whose field or place a key is; empty for what belongs to none. */
function actionOf(root: Root, key: string): string {
  return root === "actions" || root === "positions" ? splitKey(key).head : "";
}

interface LostValue {
  /** Null where the value is not known any more. */
  readonly held: { readonly value: unknown } | null;
  /** True if it would be seen now, had the person not set the key. */
  readonly isNewest: boolean;
}

/**
 * Returns the value that somebody else set here at the same time as the person, and that lost; null where there is
 * none.
 */
export function lostValue(event: Y.YMapEvent<unknown>, key: string): LostValue | null {
  const { transaction, target } = event;
  let isNewest = true;
  for (let item = target._map.get(key) ?? null; item !== null; item = item.left) {
    const { client, clock } = item.id;
    if (client === transaction.doc.clientID) continue;
    if (clock >= (transaction.beforeState.get(client) ?? 0)) {
      const content = item.content.getContent();
      return { held: content.length > 0 ? { value: content.at(-1) } : null, isNewest };
    }
    isNewest = false;
  }
  return null;
}
