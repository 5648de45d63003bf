/** What two runs had different before they began. */
import type { ComparedField, Comparison } from "../../api/review";
import style from "./compare-page.module.css";
import { fieldWords, plainValue } from "./differences";

function Fields({ fields }: { fields: readonly ComparedField[] }) {
  return (
    <ul className={style.fields}>
      {fields.map((field) => (
        <li key={field.field}>
          <span>{fieldWords(field.field)}</span> <del>{plainValue(field.before)}</del>{" "}
          <ins>{plainValue(field.after)}</ins>
        </li>
      ))}
    </ul>
  );
}

export function GraphChanges({ found }: { found: Comparison }) {
  const { actions, relations } = found.graph;
  const meaning = actions
    .map((each) => ({ ...each, fields: each.fields.filter((f) => f.field !== "position") }))
    .filter((each) => each.change !== "changed" || each.fields.length > 0);
  if (found.same_graph) return <p className={style.same}>Both ran exactly the same graph.</p>;
  return (
    <ul className={style.changes} aria-label="What changed in the graph">
      {meaning.map((change) => (
        <li key={change.aid}>
          <b>{change.name}</b> <span className={style.change}>{change.change}</span>
          <Fields fields={change.fields} />
        </li>
      ))}
      {relations.map((change) => (
        <li key={`${change.parent} ${change.child}`}>
          <b>
            {change.parent} → {change.child}
          </b>{" "}
          <span className={style.change}>{change.change}</span>
          <Fields fields={change.fields} />
        </li>
      ))}
    </ul>
  );
}
