/** What an action takes or gives, as a table; on a phone each parameter is a paragraph. */
import type { Parameter } from "../../graph/model";
import style from "./details.module.css";
import { type ParameterFacts, parameterFacts } from "./parameter-facts";

function Row({ facts, free }: { facts: ParameterFacts; free: string }) {
  const { name, type, required, allowed, value, more } = facts;
  return (
    <tr>
      <th scope="row">{name}</th>
      <td>
        <code className={style.type}>{type}</code>
      </td>
      <td className={style.said}>
        {[allowed, ...more].filter(Boolean).join(" · ") || (
          <span className={style.quiet}>{free}</span>
        )}
      </td>
      <td className={style.value}>
        {value !== null && <code>{value}</code>}{" "}
        {!required && <span className={style.quiet}>optional</span>}
      </td>
    </tr>
  );
}

interface Props {
  title: string;
  /** What is said when there are none. */
  none: string;
  parameters: readonly Parameter[];
  /** What is said where nothing is asked of a value. */
  free?: string;
}

export function ParameterTable({ title, none, parameters, free = "" }: Props) {
  const rows = parameterFacts(parameters);
  return (
    <section>
      <h3 className={style.heading}>{title}</h3>
      {rows.length === 0 ? (
        <p className={style.quiet}>{none}</p>
      ) : (
        <table className={style.table} aria-label={title}>
          <thead>
            <tr>
              <th scope="col">name</th>
              <th scope="col">type</th>
              <th scope="col">allowed</th>
              <th scope="col" className={style.value}>
                value
              </th>
            </tr>
          </thead>
          <tbody>
            {rows.map((facts) => (
              <Row key={facts.path} facts={facts} free={free} />
            ))}
          </tbody>
        </table>
      )}
    </section>
  );
}
