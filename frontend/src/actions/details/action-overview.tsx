/** An action to be read: what it is for, takes and gives, where it is used, which robots have it. */
import type { ReactNode } from "react";
import type { Parameter } from "../../graph/model";
import style from "./details.module.css";
import { ParameterTable } from "./parameter-table";

interface Props {
  description: string;
  type: string;
  labels: readonly string[];
  inputs: readonly Parameter[];
  outputs: readonly Parameter[];
  /** Where it is used, and who has it. */
  children: ReactNode;
}

const TYPES: Readonly<Record<string, string>> = {
  sync: "runs until it is done",
  async: "runs until it is done",
  spontaneous: "may report again and again",
};

export function ActionOverview({ description, type, labels, inputs, outputs, children }: Props) {
  return (
    <>
      <p className={style.lead}>{description || "Nobody has described it yet."}</p>
      <ul className={style.marks} aria-label="Type and labels">
        <li title={`Type ${type}`}>{TYPES[type] ?? `type ${type}`}</li>
        {labels.map((label) => (
          <li key={label}>{label}</li>
        ))}
      </ul>
      <ParameterTable title="Takes" none="No parameters." free="anything" parameters={inputs} />
      <ParameterTable title="Gives" none="Nothing but its outcome." parameters={outputs} />
      <div className={style.pair}>{children}</div>
    </>
  );
}
