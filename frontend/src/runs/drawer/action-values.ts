/** What is known of an action's newest visit: its values, and what it began after. Pure. */
import type { Run } from "../../api/runs";
import { fullName, type Graph, type Key } from "../../graph/model";
import { visitBegin, visitEnd } from "../../status/progress";
import { instant } from "../../ui/times";

interface KnownValue {
  readonly name: string;
  readonly text: string;
  /** `ran`: the engine showed that it ran with it; `sent`: only what was sent is known. */
  readonly from: "ran" | "sent";
}

/** An action that was seen to end before this one began, along an arrow that answers its end. */
interface BeganAfter {
  readonly name: string;
  readonly result: string;
  /** ms after the run's start. */
  readonly at: number;
}

export interface ActionValues {
  readonly name: string;
  readonly values: readonly KnownValue[];
  readonly said: string | null;
  readonly after: readonly BeganAfter[];
}

/** The value that a parameter's JSON text carries. */
export function valueText(text: string): string {
  try {
    const parsed: unknown = JSON.parse(text);
    if (typeof parsed === "object" && parsed !== null && "pvf_value" in parsed) {
      return JSON.stringify(parsed.pvf_value);
    }
  } catch {
    // not JSON: shown as it is
  }
  return text;
}

function beganAfter(run: Run, graph: Graph, key: Key, begun: number | null): BeganAfter[] {
  const start = instant(run.started_at);
  if (begun === null || start === null) return [];
  const names = new Map(graph.actions.map((action) => [action.key, fullName(action)]));
  return graph.relations.flatMap((relation): BeganAfter[] => {
    const name = relation.child === key ? names.get(relation.parent) : undefined;
    if (name === undefined) return [];
    const visits = run.actions?.[name]?.visits ?? [];
    const last = visits.findLast((visit) => (visitEnd(visit) ?? Number.POSITIVE_INFINITY) <= begun);
    const end = last ? visitEnd(last) : null;
    const outcome = last?.result ? (`on_${last.result}` as const) : null;
    if (end === null || outcome === null || relation.conditions[outcome] === "ignore") return [];
    return [{ name, result: last?.result ?? "", at: end - start }];
  });
}

/** `sent`: the values that were sent with the run, by full name. */
export function valuesOf(
  run: Run,
  graph: Graph,
  aid: Key,
  sent: Run["sent"] | undefined,
): ActionValues | null {
  const found = Object.entries(run.actions ?? {}).find(([, action]) => action.aid === aid);
  if (found === undefined) return null;
  const [name, action] = found;
  const last = action.visits.at(-1);
  const ran = last?.inputs ?? null;
  const values = Object.entries(ran ?? sent?.[name] ?? {}).map(
    ([parameter, text]): KnownValue => ({
      name: parameter.replaceAll("::", " / "),
      text: valueText(text),
      from: ran === null ? "sent" : "ran",
    }),
  );
  const begun = last ? visitBegin(last) : null;
  return {
    name,
    values,
    said: action.messages.at(-1)?.text ?? null,
    after: beganAfter(run, graph, aid, begun),
  };
}
