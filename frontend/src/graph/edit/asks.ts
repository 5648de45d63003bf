/** Edits of the marks by which a start asks for inputs. Apart from other edits, since few pages load them. */
import type * as Y from "yjs";
import { askKey, parameterKey, rootOf } from "../document-keys";
import type { Key } from "../model";
import type { Bounds } from "../parameters/asked-inputs";
import { asOneEdit, eraseKeys, hasAction, writeKey } from "./document-writes";

/** Sets whether, and within which bounds, a start asks for an input. False when that is gone. */
export function setAsk(doc: Y.Doc, key: Key, path: string, bounds: Bounds | null): boolean {
  const isThere = hasAction(doc, key) && rootOf(doc, "actions").has(parameterKey(key, "in", path));
  if (!isThere) return false;
  asOneEdit(doc, () => {
    if (bounds === null) eraseKeys(doc, "actions", askKey(key, path));
    else writeKey(doc, "actions", askKey(key, path), JSON.stringify(bounds));
  });
  return true;
}
