/** Values of a start: what people type for the inputs that it asks for, and what is sent of that. Pure. */
import type { AskedInput, EarlierValues, StartValue, StartValues } from "../api/starts";
import { parameterValueOf, shown, TYPES, typed } from "../graph/parameters/values";
import { spokenName } from "../graph/spoken-name";
import { isolated } from "../words/isolated";
import { inputWords, placeOfInput } from "./value-words";

/** Typed texts by place. */
export type Drafts = Readonly<Record<string, string>>;

/** Return a value as its field shows it; "" for none. */
export function draftOf({ type }: Pick<AskedInput, "type">, value: StartValue | undefined): string {
  if (value === undefined) return "";
  return shown(parameterValueOf(JSON.stringify({ pvf_type: type, pvf_value: value })));
}

/** The value that the text of a field gives. */
type Given =
  | { readonly kind: "value"; readonly value: StartValue }
  | { readonly kind: "none" }
  | { readonly kind: "wrong"; readonly why: string };

const MISSING: Given = { kind: "wrong", why: "Give a value." };

/** Return the value that a text means, checked like `why_wrong` in `umrf/start_values.py`. */
export function givenBy(asked: AskedInput, draft: string): Given {
  const native = TYPES.find((type) => type === asked.type);
  if (native === undefined)
    return { kind: "wrong", why: `No value of ${asked.type} can be given.` };
  if (draft.trim() === "" && (native !== "string" || draft === "")) {
    return asked.open || asked.value !== undefined ? MISSING : { kind: "none" };
  }
  const read = typed(native, draft);
  if ("wrong" in read) return { kind: "wrong", why: read.wrong };
  const value: StartValue = JSON.parse(read.ok ?? "null");
  const why = whyOutside(asked, Array.isArray(value) ? value : [value]);
  return why === "" ? { kind: "value", value } : { kind: "wrong", why };
}

function whyOutside(asked: AskedInput, members: readonly StartValue[]): string {
  const { allowed = [], least = -Infinity, most = Infinity } = asked;
  const has = (value: StartValue) => allowed.some((each) => each === value);
  if (allowed.length > 0 && !members.every(has)) {
    return `Allowed: ${allowed.map((each) => JSON.stringify(each)).join(", ")}.`;
  }
  const numbers = members.filter((each) => typeof each === "number");
  if (numbers.some((each) => each < least)) return `${least} at least.`;
  if (numbers.some((each) => each > most)) return `${most} at most.`;
  return "";
}

export interface TypedValues {
  /** Values that a start sends: those that differ from the graph's. */
  readonly values: StartValues;
  /** By place: why a text means no value. */
  readonly wrong: ReadonlyMap<string, string>;
}

/** Return what the typed texts come to. */
export function typedValues(asked: readonly AskedInput[], drafts: Drafts): TypedValues {
  const values = new Map<string, [string, StartValue][]>();
  const wrong = new Map<string, string>();
  for (const each of asked) {
    const place = placeOfInput(each);
    const given = givenBy(each, drafts[place] ?? "");
    if (given.kind === "wrong") wrong.set(place, given.why);
    // A value that the graph has anyway is left to the graph: then nothing of its version is changed.
    if (given.kind !== "value" || same(given.value, each.value)) continue;
    const known = values.get(each.action) ?? [];
    values.set(each.action, [...known, [each.name, given.value]]);
  }
  const all = [...values].map(([action, given]) => [action, Object.fromEntries(given)] as const);
  return { values: Object.fromEntries(all), wrong };
}

const same = (a: StartValue, b: StartValue | undefined): boolean =>
  JSON.stringify(a) === JSON.stringify(b);

/** Return the value that is given for an input; undefined for none. A name may be that of a member of all objects. */
function valueFor(
  { action, name }: Pick<AskedInput, "action" | "name">,
  values: StartValues | undefined,
): StartValue | undefined {
  const own = values && Object.hasOwn(values, action) ? values[action] : undefined;
  return own && Object.hasOwn(own, name) ? own[name] : undefined;
}

/** Return the texts with which a form begins: given values first, then those that the graph has. */
export function firstDrafts(
  asked: readonly AskedInput[],
  ...given: readonly (StartValues | undefined)[]
): Drafts {
  const found: Record<string, string> = {};
  for (const each of asked) {
    const known = given.map((values) => valueFor(each, values));
    const value = known.find((own) => own !== undefined) ?? each.value;
    found[placeOfInput(each)] = draftOf(each, value);
  }
  return found;
}

/** Return the place that a refusal of values points at; null if it points elsewhere. */
export function placeRefused(path: string): string | null {
  const [, top, action, name] = path
    .split("/")
    .map((each) => each.replaceAll("~1", "/").replaceAll("~0", "~"));
  return top === "values" && action !== undefined && name !== undefined
    ? placeOfInput({ action, name })
    : null;
}

/** Return what a person has to do about the first input without a usable value; null if all have one. */
export function missingWords(
  asked: readonly AskedInput[],
  drafts: Drafts,
  wrong: ReadonlyMap<string, string>,
): string | null {
  const first = asked.find((each) => wrong.has(placeOfInput(each)));
  if (first === undefined) return null;
  const where = `${isolated(inputWords(first.name))} of ${isolated(spokenName(first.action))}`;
  return (drafts[placeOfInput(first)] ?? "") === "" ? `Give ${where}` : `Correct ${where}`;
}

/** A value that somebody gave before, or that stands in the graph. */
export interface Proposal {
  readonly of: string;
  readonly value: StartValue;
}

/** Return the values to choose from for an input. `before`: those of the run that is repeated. */
export function proposalsFor(
  asked: AskedInput,
  before: StartValues | undefined,
  earlier: EarlierValues | null,
): Proposal[] {
  const { value, example } = asked;
  const known: [string, StartValue | undefined][] = [
    ["in the graph", value],
    ["that run", valueFor(asked, before)],
    [`run ${earlier?.run}`, valueFor(asked, earlier?.values)],
    ["example", example],
  ];
  return known.flatMap(([of, each]) => (each === undefined ? [] : [{ of, value: each }]));
}
