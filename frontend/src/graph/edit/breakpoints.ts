/** Edits of breakpoints: each is a key of its action or arrow, and goes where that goes. */
import type * as Y from "yjs";
import { type Breakpoint, breakpointText } from "../breakpoints";
import type { Root } from "../document-keys";
import {
  asOneEdit,
  eraseKeys,
  hasAction,
  hasRelation,
  numberGhosts,
  writeKey,
} from "./document-writes";

/** Sets the breakpoint of an action or arrow, or takes it away. False when that is gone. */
export function setBreakpoint(doc: Y.Doc, id: string, breakpoint: Breakpoint | null): boolean {
  return asOneEdit(doc, () => {
    numberGhosts(doc);
    const root: Root | null = hasAction(doc, id)
      ? "actions"
      : hasRelation(doc, id)
        ? "relations"
        : null;
    if (root === null) return false;
    if (breakpoint === null) eraseKeys(doc, root, `${id}|breakpoint`);
    else writeKey(doc, root, `${id}|breakpoint`, breakpointText(breakpoint));
    return true;
  });
}
