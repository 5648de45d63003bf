/** When an action runs, as a sentence. */
import { relationId } from "../../graph/layout";
import { type Action, ENTRY } from "../../graph/model";
import { answersOf } from "../../ui/canvas/elements";
import { OutcomeSign, outcomeColor, outcomeWord } from "../../ui/outcome";
import { endName, useBench } from "../bench";
import style from "./details.module.css";

const verbs = {
  run: "runs when",
  stop: "is stopped when",
  pause: "is paused when",
  restart: "starts again when",
  bypass: "is passed over when",
  ignore: "",
} as const;

export function RunsWhen({ action }: { action: Action }) {
  const { graph, select } = useBench();
  const into = graph.relations.filter((relation) => relation.child === action.key);
  const required = into.filter((relation) => relation.required);
  return (
    <section className={style.section}>
      <div className={style.heading}>
        <h3>Runs when</h3>
      </div>
      <div className={style.say}>
        <div>
          {into.length === 0 && "Nothing leads here, so it never runs."}
          {into.map((relation) => {
            if (relation.parent === ENTRY) return <p key="entry">The graph starts.</p>;
            return (
              <p key={relationId(relation)}>
                <button
                  type="button"
                  className={style.inline}
                  onClick={() => select([relationId(relation)])}
                >
                  {endName(graph, relation.parent)}
                </button>{" "}
                {answersOf(relation).map((answer, i) => (
                  <span key={answer.response}>
                    {i > 0 && "; "}
                    {answer.response !== "run" && `(${verbs[answer.response]}) `}
                    {answer.outcomes.map((outcome, n) => (
                      <span key={outcome}>
                        {n > 0 && " or "}
                        <span className={style.outcome} style={{ color: outcomeColor[outcome] }}>
                          <OutcomeSign outcome={outcome} size={11} /> {outcomeWord[outcome]}
                        </span>
                      </span>
                    ))}
                  </span>
                ))}
                {!relation.required && <span className={style.quiet}> · optional</span>}
              </p>
            );
          })}
          {required.length > 1 && (
            <p className={style.quiet}>
              Waits until all {required.length} have reported; the last one decides.
            </p>
          )}
        </div>
      </div>
    </section>
  );
}
