/** Every visit of two runs beside each other. */
import type { ComparedStep, Comparison } from "../../api/review";
import type { Visit } from "../../api/runs";
import { durationText } from "../../status/durations";
import { INTO } from "../../status/level-words";
import { visitDuration } from "../../status/progress";
import { StateLabel } from "../../status/state-label";
import style from "./compare-page.module.css";

/** How it ended; that nobody knows how is something else than that nobody saw an end. */
function outcome(visit: Visit): string {
  return visit.result ?? (visit.until === null ? "went on" : "result unknown");
}

function took(visit: Visit): string {
  if (visit.until === null) return "no end seen";
  return durationText(visitDuration(visit)) ?? "its code may go on";
}

function VisitCell({ visit, slower }: { visit: Visit | null; slower: boolean }) {
  if (visit === null) return <span className={style.none}>never ran</span>;
  const result = visit.result;
  const tone = result ?? (visit.until === null ? "run" : "unknown");
  return (
    <span className={style.visit}>
      <StateLabel tone={tone} word={outcome(visit)} />
      <span className={style.took} data-slower={slower || undefined}>
        {took(visit)}
        {slower && " · slower"}
        {visit.how === "inferred" && " · inferred"}
      </span>
    </span>
  );
}

const RELATIONS: Record<ComparedStep["relation"], string> = {
  same: "the same",
  result: "another result",
  only_a: "only in the first",
  only_b: "only in the second",
  unknown: "not known",
  end: "only one end was seen",
};

export function Steps({ found }: { found: Comparison }) {
  const parting = found.parting?.step;
  const is = (step: ComparedStep) =>
    step.action === parting?.action && step.visit === parting.visit;
  return (
    <table className={style.steps}>
      <thead>
        <tr>
          <th>Action</th>
          <th>Run {found.a.number}</th>
          <th>Run {found.b.number}</th>
          <th>Both</th>
        </tr>
      </thead>
      <tbody>
        {found.steps.map((step) => (
          <tr
            key={`${step.action} ${step.visit}`}
            data-relation={step.relation}
            data-parting={is(step) || undefined}
          >
            <th scope="row">
              <bdi>{[...step.levels, step.name].join(INTO)}</bdi>
              {step.visit > 1 && <span className={style.none}> visit {step.visit}</span>}
            </th>
            <td>
              <VisitCell visit={step.a} slower={step.slower === "a"} />
            </td>
            <td>
              <VisitCell visit={step.b} slower={step.slower === "b"} />
            </td>
            <td className={style.relation}>
              {is(step) ? "here they part" : RELATIONS[step.relation]}
            </td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
