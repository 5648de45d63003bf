/** Finding actions and arrows of a graph by anything that they say. Pure. */
import type { Problem } from "../api/graphs";
import type { PartOnCard } from "../canvas/editor-store";
import { relationId } from "../graph/document-keys";
import { pathWords, valueText } from "../graph/field-words";
import { ENTRY, type Graph, type Key, PRECONDITIONS } from "../graph/model";
import { placeOf } from "../graph/problems/problem-groups";
import { shownName } from "../graph/questions";
import { endLabel } from "../graph/spoken-name";
import { isolated } from "../words/isolated";

export interface Hit {
  /** Key of the action, or id of the relation. */
  readonly id: string;
  readonly kind: "action" | "arrow";
  readonly title: string;
  /** The part that matches: `robot arm`. Empty when the title matches. */
  readonly why: string;
  /** The keys that must be on the canvas for it to be seen. */
  readonly keys: readonly Key[];
}

/** One thing that is said, and under which word it can be asked for: `robot:arm`. */
interface Fact {
  readonly field: string;
  readonly text: string;
}

interface SearchEntry extends Omit<Hit, "why"> {
  readonly facts: readonly Fact[];
}

/** The words that people may write before a colon. */
const FIELDS = [
  "name", "type", "robot", "about", "parameter", "output", "response", "remap", "problem", "field",
] as const; // biome-ignore format: one list

const titleOf = (graph: Graph, key: Key): string => {
  const end = endLabel(key);
  if (end !== null) return end;
  const action = graph.actions.find((candidate) => candidate.key === key);
  return action ? `${shownName(action.name)} ${action.instanceId}` : "";
};

function entriesOf(graph: Graph, problems: readonly Problem[]): SearchEntry[] {
  const wrong = (id: string): Fact[] =>
    problems
      .filter((problem) => placeOf(problem) === id)
      .map(({ code, message }) => ({ field: "problem", text: `${code} ${message}` }));
  const names = new Map(graph.actions.map(({ key }) => [key, titleOf(graph, key)]));
  const name = (key: Key) => names.get(key) ?? titleOf(graph, key);
  const actions = graph.actions.map((action): SearchEntry => {
    const values = (list: typeof action.inputs, field: string): Fact[] =>
      list.map((each) => {
        const value = valueText(each);
        return { field, text: `${pathWords(each.path)}${value === null ? "" : ` = ${value}`}` };
      });
    return {
      id: action.key,
      kind: "action",
      title: name(action.key),
      keys: [action.key],
      facts: [
        { field: "name", text: `${name(action.key)} ${action.name}_${action.instanceId}` },
        { field: "robot", text: action.actor },
        { field: "about", text: action.description },
        ...values(action.inputs, "parameter"),
        ...values(action.outputs, "output"),
        { field: "type", text: action.type },
        ...wrong(action.key),
        ...action.extra.map(([field, text]) => ({ field: "field", text: `${field} ${text}` })),
      ],
    };
  });
  const arrows = graph.relations.map((relation): SearchEntry => {
    const said = PRECONDITIONS.filter((outcome) => relation.conditions[outcome] !== "ignore");
    return {
      id: relationId(relation),
      kind: "arrow",
      title: `${isolated(name(relation.parent))} → ${isolated(name(relation.child))}`,
      keys: [relation.parent, relation.child],
      facts: [
        ...(relation.parent === ENTRY ? [] : said).map((outcome) => ({
          field: "response",
          text: `${outcome.slice(3)} → ${relation.conditions[outcome]}`,
        })),
        ...(relation.required ? [] : [{ field: "response", text: "optional" }]),
        ...relation.remap.map(({ source, target }) => ({
          field: "remap",
          text: `${source} → ${target}`,
        })),
        ...wrong(relationId(relation)),
      ],
    };
  });
  return [...actions, ...arrows];
}

interface Word {
  readonly field: string | null;
  readonly text: string;
}

function wordsOf(query: string): Word[] {
  return (query.toLowerCase().match(/\S+/g) ?? []).map((word) => {
    const [head = "", ...rest] = word.split(":");
    const known = FIELDS.some((field) => field === head) && rest.length > 0;
    return known ? { field: head, text: rest.join(":") } : { field: null, text: word };
  });
}

const says = (fact: Fact, { field, text }: Word): boolean =>
  (field === null || fact.field === field) && fact.text.toLowerCase().includes(text);

/** All that say every word of the query; those whose name says it first. */
export function find(graph: Graph, problems: readonly Problem[], query: string): Hit[] {
  const words = wordsOf(query);
  if (words.length === 0) return [];
  const hits = entriesOf(graph, problems).flatMap(({ facts, ...entry }) => {
    const reasons: Fact[] = [];
    for (const word of words) {
      const fact = facts.find((candidate) => says(candidate, word));
      if (fact === undefined) return [];
      if (fact.field !== "name" && !reasons.includes(fact)) reasons.push(fact);
    }
    const why = reasons.map(({ field, text }) => `${field} ${text}`).join(" · ");
    return [{ ...entry, why: why.length > 160 ? `${why.slice(0, 160)} …` : why }];
  });
  const rank = (hit: Hit) => (hit.why === "" ? 0 : hit.kind === "action" ? 1 : 2);
  return hits.sort((a, b) => rank(a) - rank(b));
}

/** Finds actions that are drawn on cards of the graph, at the places of those cards. */
export function findInside(
  graph: Graph,
  partsOf: ((key: Key) => readonly PartOnCard[]) | undefined,
  query: string,
): Hit[] {
  if (partsOf === undefined || query.trim() === "") return [];
  return graph.actions.flatMap(({ key, name }) => {
    const parts = partsOf(key);
    const names = new Map([
      [key, name],
      ...parts.map(({ path, action }) => [path, action.name] as const),
    ]);
    const actions = parts.map(({ path, action }) => ({ ...action, key: path }));
    return find({ ...graph, actions, relations: [] }, [], query).map((hit) => {
      const keys = hit.id.split("/").slice(0, -1);
      const levels = keys.map((_, n) => names.get(keys.slice(0, n + 1).join("/")) ?? "");
      const why = [`in ${levels.join(" › ")}`, ...(hit.why === "" ? [] : [hit.why])].join(" · ");
      return { ...hit, keys: [key], why };
    });
  });
}
