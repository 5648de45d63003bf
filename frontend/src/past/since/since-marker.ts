/** What of a graph is another thing than at an earlier moment. What stays the same is compared once. Pure. */
import type { SinceMark } from "../../canvas/marks/since-marks";
import { relationId } from "../../graph/document-keys";
import type { Action, Graph, Relation } from "../../graph/model";
import { type FieldChange, linesOf } from "../../history/difference-words";
import { changedAction, changedRelation } from "../compare/graph-difference";

const MOST = 2; // fields that are told

const ADDED: SinceMark = { change: "added", words: "", fields: [] };

/** As the history calls them. */
const FIELDS: ReadonlyMap<string, string> = new Map([
  ["name", ""],
  ["robot", "actor"],
  ["waits for it", "required"],
]);
const fieldOf = ({ field }: FieldChange): string =>
  FIELDS.get(field) ?? field.replace(/^when (true|false|error|stopped)$/, "on_$1");

const short = (text: string | null): string => {
  if (text === null || text === "") return "nothing";
  return text.length > 40 ? `${text.slice(0, 40)}…` : text;
};

function markOf(fields: readonly FieldChange[] | null): SinceMark | null {
  if (fields === null) return null;
  const lines = linesOf(fields);
  const told = lines
    .slice(0, MOST)
    .map(
      ({ name, before, after }) =>
        `${name.replace(/^input /, "")} ${short(before)} → ${short(after)}`,
    );
  const more = lines.length > MOST ? ` and ${lines.length - MOST} more` : "";
  return { change: "changed", words: told.join(", ") + more, fields: fields.map(fieldOf) };
}

export class SinceMarker {
  readonly #actions: ReadonlyMap<string, Action>;
  readonly #relations: ReadonlyMap<string, Relation>;
  /** By what it is now, which is the same object as long as it is the same. */
  readonly #known = new WeakMap<Action | Relation, SinceMark | null>();
  #last: ReadonlyMap<string, SinceMark> = new Map();

  constructor(before: Graph) {
    this.#actions = new Map(before.actions.map((each) => [each.key, each]));
    this.#relations = new Map(before.relations.map((each) => [relationId(each), each]));
  }

  /** By key of an action and id of a relation; the same map as long as nothing else is marked. */
  marks(now: Graph): ReadonlyMap<string, SinceMark> {
    const found = new Map<string, SinceMark>();
    for (const each of now.actions) {
      const mark = this.#mark(each, this.#actions.get(each.key), changedAction);
      if (mark !== null) found.set(each.key, mark);
    }
    for (const each of now.relations) {
      const id = relationId(each);
      const mark = this.#mark(each, this.#relations.get(id), changedRelation);
      if (mark !== null) found.set(id, mark);
    }
    const last = this.#last;
    const same = found.size === last.size && [...found].every(([key, m]) => last.get(key) === m);
    if (!same) this.#last = found;
    return this.#last;
  }

  #mark<T extends Action | Relation>(
    now: T,
    before: T | undefined,
    changed: (before: T, after: T) => FieldChange[] | null,
  ): SinceMark | null {
    const known = this.#known.get(now);
    if (known !== undefined) return known;
    const mark = before === undefined ? ADDED : markOf(changed(before, now));
    this.#known.set(now, mark);
    return mark;
  }
}
