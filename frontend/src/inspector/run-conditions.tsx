/** Shows when something runs, in sentences: what the engine would really do. */

import { useEditorContext } from "../edit-actions/editor-context";
import type { Key } from "../graph/model";
import { startWords } from "../graph/relation-words";
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
    </section>
  );
}
