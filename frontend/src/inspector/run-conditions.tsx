/** Shows when something runs, in sentences: what the engine would really do. */

import { useEditorContext } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import { EXIT, type Key } from "../graph/model";
import { robotActionWords, startWords } from "../graph/relation-words";
import { handOverLabel, handOverOf, robotOf } from "../graph/robots";
import { colorOfName } from "../ui/name-colors";
import style from "./inspector.module.css";

export function RunConditions({ of, title }: { of: Key; title: string }) {
  const { graph } = useEditorContext();
  return (
    <section className={style.section} data-form={of}>
      <div className={style.heading}>
        <h2>{title}</h2>
      </div>
      <div className={style.say}>
        <div>
          {startWords(graph, of).map((sentence) => (
            <p key={sentence}>{sentence}</p>
          ))}
        </div>
      </div>
      {of !== EXIT && <OtherRobots of={of} />}
    </section>
  );
}

/** Shows for which actions of other robots an action waits; each leads to its arrow. */
function OtherRobots({ of }: { of: Key }) {
  const { graph, select } = useEditorContext();
  const robots = robotOf(graph);
  const arrows = graph.relations.flatMap((relation) => {
    const hand = relation.child === of ? handOverOf(relation, robots) : null;
    return hand === null ? [] : [{ id: relationId(relation), relation, hand }];
  });
  return arrows.map(({ id, relation, hand }) => (
    <button
      key={id}
      type="button"
      className={`${style.hand} finger`}
      title={handOverLabel(hand)}
      onClick={() => select([id])}
    >
      <i style={{ background: colorOfName(hand.from) }} aria-hidden />
      {hand.waits ? "Waits for" : "Started by"} {robotActionWords(graph, relation.parent)}
    </button>
  ));
}
