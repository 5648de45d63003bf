/** Names and values below each other. */
import type { ReactNode } from "react";
import style from "./administration.module.css";

export interface StatusFact {
  readonly name: string;
  readonly value: ReactNode;
  /** Somebody should look at it. */
  readonly isBad?: boolean;
}

export function Facts({ facts }: { facts: readonly StatusFact[] }) {
  return (
    <dl className={style.facts}>
      {facts.map(({ name, value, isBad }) => (
        <div key={name} data-bad={isBad || undefined}>
          <dt>{name}</dt>
          <dd>{value}</dd>
        </div>
      ))}
    </dl>
  );
}
