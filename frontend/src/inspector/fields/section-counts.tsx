/** How much of a part of a form is wrong or to fill in. */
import { use } from "react";
import type { ParameterSide } from "../../graph/document-keys";
import type { Key } from "../../graph/model";
import { countsOf } from "../../graph/problems/problem-kinds";
import style from "../inspector.module.css";
import { fieldOfTold, ProblemsContext } from "./field-problems";

export function SectionCounts({ of, side }: { of: Key; side: ParameterSide }) {
  const here = use(ProblemsContext).filter(
    (told) => told.place === of && fieldOfTold(told)?.startsWith(`${side}/`),
  );
  const { wrong, fillIn } = countsOf(here);
  if (wrong + fillIn === 0) return null;
  return (
    <span className={style.counts}>
      {wrong > 0 && <span data-kind="wrong">{wrong} wrong</span>}
      {fillIn > 0 && <span data-kind="fill-in">{fillIn} to fill in</span>}
    </span>
  );
}
