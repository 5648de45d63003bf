/** A value that a field had before, set again: an edit like any other, which can be undone. */
import type * as Y from "yjs";
import { addParameter, setField, setParameter, setRequired, setResponse } from "../../graph/edit";
import { memberText } from "../../graph/json-members";
import { PRECONDITIONS, RESPONSES } from "../../graph/model";
import { withValue } from "../../graph/parameters/values";

const FIELDS = ["type", "actor", "description"] as const;

/** Whether this is something that people set by itself: a value, a text, what follows an outcome. */
export function canSetBack(field: string, value: unknown): boolean {
  if (value === null || value === undefined) return false;
  return /^in\/|^(type|actor|description|required|on_(true|false|error|stopped))$/.test(field);
}

/** The value alone, where what stands around it was not changed in kind since. */
function asIt(now: string, then: string): string {
  const [type, value] = [memberText(then, "pvf_type"), memberText(then, "pvf_value")];
  return type !== null && type === memberText(now, "pvf_type") ? withValue(now, value) : then;
}

function setInput(doc: Y.Doc, key: string, path: string, then: string): boolean {
  return (
    setParameter(doc, key, "in", path, (now) => asIt(now, then)) ||
    addParameter(doc, key, "in", path, then)
  );
}

/** Whether it was done: what it belongs to may be gone. */
export function setBack(doc: Y.Doc, of: string, field: string, value: unknown): boolean {
  if (field === "required") return setRequired(doc, of, value !== false);
  if (typeof value !== "string") return false;
  if (field.startsWith("in/")) return setInput(doc, of, field.slice(3), value);
  const own = FIELDS.find((each) => each === field);
  if (own !== undefined) return setField(doc, of, own, value);
  const outcome = PRECONDITIONS.find((each) => each === field);
  const response = RESPONSES.find((each) => each === value);
  return outcome !== undefined && response !== undefined && setResponse(doc, of, outcome, response);
}
