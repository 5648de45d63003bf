/** Bundles: outcomes of a relation with the same response are drawn as one line. Pure. */
import { relationId } from "../../graph/document-keys";
import {
  ENTRY,
  type Key,
  type Position,
  PRECONDITIONS,
  type Precondition,
  type Relation,
  type Response,
} from "../../graph/model";
import { type HandOver, handOverOf, isResponding, type RobotOf } from "../../graph/robots";
import { readWaypoints } from "../../graph/waypoints";
import type { PillSize } from "./scene";

/** One line between two cards. */
export interface Bundle {
  /** The id stays the same while outcomes are added and removed. */
  readonly id: string;
  readonly relation: string;
  readonly source: Key;
  readonly target: Key;
  readonly response: Response;
  /** The outcomes in their fixed order; empty if the relation ignores all of them. */
  readonly outcomes: readonly Precondition[];
  /** The target does not wait for it. */
  readonly optional: boolean;
  /** True if the bundle starts at the entry, which has no outcomes. */
  readonly entry: boolean;
  /** Places through which people have led the line. */
  readonly waypoints: readonly Position[];
}

/**
 * Return the bundles of a relation. A pair that a file lists twice has two relations with lines of
 * their own, since each is selected and changed separately.
 */
export function bundlesOf(relation: Relation): readonly Bundle[] {
  const before = known.get(relation);
  if (before) return before;
  const bundles = made(relation);
  known.set(relation, bundles);
  return bundles;
}

/** Results by relation; a relation is the same object until somebody changes it. */
const known = new WeakMap<Relation, readonly Bundle[]>();

function made(relation: Relation): Bundle[] {
  const id = relationId(relation);
  const outcomes = new Map<Response, Precondition[]>();
  for (const outcome of PRECONDITIONS) {
    const response = relation.conditions[outcome];
    if (response === "ignore") continue;
    outcomes.set(response, [...(outcomes.get(response) ?? []), outcome]);
  }
  if (outcomes.size === 0) outcomes.set("ignore", []);
  return [...outcomes].map(([response, outcomes]) => ({
    id: `${id}|${response}`,
    relation: id,
    source: relation.parent,
    target: relation.child,
    response,
    outcomes,
    optional: !relation.required,
    entry: relation.parent === ENTRY,
    waypoints: readWaypoints(relation.waypoints.find(([r]) => r === response)?.[1] ?? "[]"),
  }));
}

/** Returns the two robots of a bundle that leads from one to another; null for any other bundle. */
export type HandOvers = (bundle: Pick<Bundle, "relation" | "response">) => HandOver | null;

/** Find the arrows between actions of two robots; a bundle that does nothing is none of them. */
export function handOversIn(relations: readonly Relation[], robots: RobotOf): HandOvers {
  const found = new Map<string, HandOver>();
  for (const relation of robots.size > 0 ? relations : []) {
    const hand = handOverOf(relation, robots);
    if (hand !== null) found.set(relationId(relation), hand);
  }
  return ({ relation, response }) =>
    isResponding(response) ? (found.get(relation) ?? null) : null;
}

/** Return the word on a pill beside its signs. The usual response `run` has none. */
export function pillWord({ response, entry }: Pick<Bundle, "response" | "entry">): string {
  if (entry || response === "run") return "";
  return response === "ignore" ? "ignores all" : response;
}

/** Measures of a pill in px at zoom 1, as `outcome-arrow.module.css` sets them. */
const PILL_HEIGHT = 20;
const EDGE = 13;
const GLYPH = 13;
const LETTER = 7.3;
const BADGE = 34;
const HAND = 42;

/**
 * Return the size of a bundle's pill, px; null if it has nothing to show. `handed`: it leads from
 * one robot to another.
 */
export function pillSizeOf(bundle: Bundle, marked: boolean, handed = false): PillSize | null {
  const word = pillWord(bundle);
  const glyphs = bundle.entry ? 0 : bundle.outcomes.length;
  if (glyphs === 0 && word === "" && !marked) return null;
  const said = word === "" ? 0 : word.length * LETTER + 3;
  const lean = EDGE + glyphs * GLYPH + said;
  const more = (marked ? BADGE : 0) + (handed ? HAND : 0);
  const size = { width: Math.ceil(lean + more), height: PILL_HEIGHT };
  return more > 0 && lean > EDGE ? { ...size, lean: Math.ceil(lean) } : size;
}
