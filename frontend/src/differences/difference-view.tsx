/**
 * Shows differences between two moments: actions and arrows that were added, removed or changed,
 * field by field.
 */
import type { GraphDifference } from "../api/graphs";
import { isolated } from "../words/isolated";
import style from "./difference-view.module.css";
import { type FieldChange, linesOf } from "./difference-words";

type Changes = Pick<GraphDifference, "actions" | "relations"> & { fields?: readonly FieldChange[] };

function Fields({ fields }: { fields: readonly FieldChange[] }) {
  const lines = linesOf(fields);
  return (
    <ul className={style.fields}>
      {lines.map((line) => (
        <li key={`${line.name} ${line.before === null}`}>
          <span>{line.name}</span>{" "}
          {line.before !== null && (
            <del>
              <i className="weight-700 not-italic" aria-hidden>
                −
              </i>{" "}
              {line.before}
            </del>
          )}{" "}
          {line.after !== null && (
            <ins>
              <i className="weight-700 not-italic" aria-hidden>
                +
              </i>{" "}
              {line.after}
            </ins>
          )}
        </li>
      ))}
    </ul>
  );
}

/** Places of cards mean nothing; who looks for what was moved looks at the canvas. */
const isMeant = ({ field }: FieldChange): boolean => field !== "position";

/** Return whether a difference has any change of meaning. */
export function meansSomething({ actions, relations, fields = [] }: Changes): boolean {
  const action = actions.some((each) => each.change !== "changed" || each.fields.some(isMeant));
  return action || relations.length > 0 || fields.length > 0;
}

export function DifferenceView({ found, label }: { found: Changes; label: string }) {
  const actions = found.actions
    .map((each) => ({ ...each, fields: each.fields.filter(isMeant) }))
    .filter((each) => each.change !== "changed" || each.fields.length > 0);
  return (
    <ul className={style.changes} aria-label={label}>
      {found.fields !== undefined && found.fields.length > 0 && (
        <li>
          <Fields fields={found.fields} />
        </li>
      )}
      {actions.map((change) => (
        <li key={change.aid} data-change={change.change}>
          <b>{change.name}</b> <span className="ink3">{change.change}</span>
          <Fields fields={change.fields} />
        </li>
      ))}
      {found.relations.map((change) => (
        <li key={`${change.parent} ${change.child}`} data-change={change.change}>
          <b>
            {isolated(change.parent)} → {isolated(change.child)}
          </b>{" "}
          <span className="ink3">{change.change}</span>
          <Fields fields={change.fields} />
        </li>
      ))}
    </ul>
  );
}
