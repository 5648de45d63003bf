/**
 * Keeps translations and extensions from breaking what React drew. They move and remove nodes that React
 * still holds: its next change of them then throws, and the page goes blank, or an old word stays in
 * front of the new one. The page asks for no translation (`translate="no"`); this is for those who do
 * not obey.
 */
import { tick } from "../../clock/server-clock";

const OFTEN = 20; // times that a page is put right within `WITHIN`; who goes on is a fight, and is told
const WITHIN = 10_000; // ms

/**
 * Return whether a node is a `<font>`: translators wrap texts in it, and this page never draws one.
 */
const isWrapper = (node: Node | null): node is HTMLElement => node?.nodeName === "FONT";

/** The child of `parent` in which `node` stands now; null when it is nowhere in it. */
function childAround(parent: Node, node: Node): Node | null {
  let at: Node | null = node;
  while (at !== null && at.parentNode !== parent) at = at.parentNode;
  return at;
}

/** The wrapper that one record put in the place of a text, or beside it just before it was taken away. */
function wrapperFor({ addedNodes, previousSibling, nextSibling }: MutationRecord): Node | null {
  return [...addedNodes, previousSibling, nextSibling].find(isWrapper) ?? null;
}

/** Put back the texts that were wrapped, or taken away in favour of a wrapper; whether there were any. */
function unwrap(records: readonly MutationRecord[]): boolean {
  let found = false;
  for (const record of records) {
    const parent = record.target;
    if (isWrapper(parent)) continue;
    for (const text of record.removedNodes) {
      if (isWrapper(text) || text.parentNode === parent) continue;
      const inside = childAround(parent, text);
      const wrapper = inside ?? (text.parentNode === null ? wrapperFor(record) : null);
      if (!isWrapper(wrapper) || wrapper.parentNode !== parent) continue;
      parent.insertBefore(text, wrapper);
      found = true;
    }
  }
  // Only now: one wrapper may have taken the place of several texts.
  for (const { addedNodes } of records) {
    for (const node of addedNodes) {
      if (!isWrapper(node) || node.parentNode === null) continue;
      node.remove();
      found = true;
    }
  }
  return found;
}

/** Have React's own removals and insertions find nodes that are elsewhere by now, and tell of it. */
function tolerateMovedNodes(onChange: () => void): void {
  const { removeChild, insertBefore } = Node.prototype;
  Node.prototype.removeChild = function <T extends Node>(this: Node, child: T): T {
    if (child.parentNode === this) return removeChild.call(this, child) as T;
    onChange();
    const around = childAround(this, child);
    if (around !== null) removeChild.call(this, around);
    return child;
  };
  Node.prototype.insertBefore = function <T extends Node>(this: Node, node: T, at: Node | null): T {
    if (at === null || at.parentNode === this) return insertBefore.call(this, node, at) as T;
    onChange();
    return insertBefore.call(this, node, childAround(this, at)) as T;
  };
}

/**
 * Take back what translators do, before React draws again, and let no node that was moved or removed
 * break it. `onChange` is called when the page may say something old or wrong all the same.
 */
export function outliveOutsideChanges(onChange: () => void): void {
  tolerateMovedNodes(onChange);
  let times: number[] = [];
  const observer = new MutationObserver((records) => {
    if (!unwrap(records)) return;
    const now = tick();
    times = [...times.filter((at) => now - at < WITHIN), now];
    if (times.length > OFTEN) {
      observer.disconnect();
      onChange();
    } else observer.takeRecords(); // of its own doing
  });
  observer.observe(document.documentElement, { childList: true, subtree: true });
}
