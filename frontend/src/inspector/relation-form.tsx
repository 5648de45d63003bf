/** The form of an arrow: a response to each of the four outcomes, and the outputs that it carries over. */
import { Button, Select, Switch } from "@mantine/core";
import { IconArrowDown, IconTrash } from "@tabler/icons-react";
import { OUTCOMES, OutcomeSign, outcomeColor, outcomeWord } from "../canvas/outcome";
import { useEditorContext } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import { removeRelation, setRequired, setResponse } from "../graph/edit";
import { ENTRY, EXIT, RESPONSES, type Relation, type Response } from "../graph/model";
import { endName, handOverWords, ignoredWords, relationWords } from "../graph/relation-words";
import { handOverLabel, handOverOf, robotOf } from "../graph/robots";
import { isolated } from "../words/isolated";
import { ArrowBreakpoint } from "./breakpoint-field";
import { SharedField } from "./fields/shared-field";
import style from "./inspector.module.css";
import { RemapList } from "./parameters/remap-list";

const meaning: Record<Response, string> = {
  run: "run it",
  ignore: "do nothing",
  bypass: "pass it over",
  stop: "stop it",
  pause: "pause it",
  restart: "nothing: not done by the engine",
};

const responses = RESPONSES.map((value) => ({ value, label: `${value} · ${meaning[value]}` }));

export function RelationForm({ relation }: { relation: Relation }) {
  const context = useEditorContext();
  const { doc, graph } = context;
  const id = relationId(relation);
  const parent = endName(graph, relation.parent);
  const child = endName(graph, relation.child);
  const entry = relation.parent === ENTRY;
  const hand = handOverOf(relation, robotOf(graph));
  // A pause says more than who pauses, and a restart does nothing.
  const plain = Object.values(relation.conditions).some((each) => /pause|restart/.test(each));
  const sentences =
    hand === null || plain ? relationWords(graph, relation) : handOverWords(graph, relation);
  const nothing = ignoredWords(graph, relation);
  return (
    <div className={style.form} data-form={id}>
      <div className={style.ends}>
        <button
          type="button"
          className={style.end}
          onClick={() => context.select([relation.parent])}
        >
          {parent}
        </button>
        <IconArrowDown size={15} aria-label="leads to" />
        <button
          type="button"
          className={style.end}
          onClick={() => context.select([relation.child])}
        >
          {child}
        </button>
      </div>
      {entry ? (
        <p className="m-0 ink2">The graph starts with {isolated(child)}.</p>
      ) : (
        <>
          <section className={style.section}>
            <SharedField of={id} field="conditions">
              {OUTCOMES.map((outcome) => (
                <div className={style.answer} key={outcome}>
                  <span className={style.when} style={{ color: outcomeColor[outcome] }}>
                    <OutcomeSign outcome={outcome} /> {outcomeWord[outcome]}
                  </span>
                  <Select
                    aria-label={`When ${isolated(parent)} is ${outcomeWord[outcome]}`}
                    data={responses}
                    value={relation.conditions[outcome]}
                    onChange={(next) =>
                      setResponse(doc, id, outcome, (next ?? "ignore") as Response)
                    }
                    flex={1}
                  />
                </div>
              ))}
            </SharedField>
          </section>
          <div className={style.say}>
            <div>
              {hand !== null && (
                <p>
                  <b>{handOverLabel(hand)}</b>
                </p>
              )}
              {sentences.map((sentence) => (
                <p key={sentence}>{sentence}</p>
              ))}
              {nothing !== null && <p>{nothing}</p>}
            </div>
          </div>
          <SharedField of={id} field="required">
            <Switch
              label={`${isolated(child)} waits for this`}
              description={
                relation.required
                  ? `It ${relation.child === EXIT ? "ends the graph" : "runs"} only after all that it waits for have reported.`
                  : "Optional: it need not report."
              }
              checked={relation.required}
              onChange={(event) => setRequired(doc, id, event.currentTarget.checked)}
            />
          </SharedField>
          {relation.child !== EXIT && (
            <SharedField of={id} field="remap">
              <RemapList relation={relation} />
            </SharedField>
          )}
          <ArrowBreakpoint relation={relation} />
        </>
      )}
      <Button
        leftSection={<IconTrash size={14} />}
        color="red"
        variant="subtle"
        onClick={() => {
          removeRelation(doc, id);
          context.select([]);
        }}
      >
        Delete this arrow
      </Button>
    </div>
  );
}
