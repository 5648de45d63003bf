/** The arrows of an action as lines of text, and drawing one by keyboard. */
import { ActionIcon, Button, Select } from "@mantine/core";
import { IconPlus, IconX } from "@tabler/icons-react";
import { useState } from "react";
import { responsesOf } from "../canvas/elements";
import { OUTCOMES, OutcomeSign, outcomeColor, outcomeWord } from "../canvas/outcome";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import { connect, removeRelation, setEntry, unsetEntry } from "../graph/edit";
import { type Action, ENTRY, EXIT, type Precondition, type Relation } from "../graph/model";
import { endName } from "../graph/relation-words";
import { handOverOf, robotOf, robotWord } from "../graph/robots";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import style from "./inspector.module.css";

function Line({ relation, context }: { relation: Relation; context: EditorContext }) {
  const id = relationId(relation);
  const answers = responsesOf(relation);
  const hand = handOverOf(relation, robotOf(context.graph));
  return (
    <li className={style.arrow}>
      <button type="button" className={style.arrowText} onClick={() => context.select([id])}>
        {answers.map((answer) => (
          <span key={answer.response}>
            {answer.outcomes.map((outcome) => (
              <span
                key={outcome}
                className={style.outcome}
                style={{ color: outcomeColor[outcome] }}
              >
                <OutcomeSign outcome={outcome} size={11} /> {outcomeWord[outcome]}
              </span>
            ))}
            <span className="ink3"> → {answer.response} </span>
          </span>
        ))}
        {answers.length === 0 && <span className="ink3">ignored → </span>}
        <b>{endName(context.graph, relation.child)}</b>
        {hand && <span className="ink3"> · {robotWord(hand.to)}</span>}
      </button>
      <Tooltip label="Delete this arrow">
        <ActionIcon
          size="sm"
          aria-label={`Delete the arrow to ${isolated(endName(context.graph, relation.child))}`}
          onClick={() => removeRelation(context.doc, id)}
        >
          <IconX size={13} />
        </ActionIcon>
      </Tooltip>
    </li>
  );
}

function Connect({ action, onDone }: { action: Action; onDone: () => void }) {
  const context = useEditorContext();
  const [outcome, setOutcome] = useState<Precondition>("on_true");
  const targets = [
    { value: EXIT, label: "Exit: the graph ends" },
    ...context.graph.actions
      .filter((other) => other.key !== action.key)
      .map((other) => ({ value: other.key, label: `${other.name} ${other.instanceId}` })),
  ];
  return (
    <div className="flex gap-37_5">
      <Select
        aria-label="When it is"
        data={OUTCOMES.map((value) => ({ value, label: outcomeWord[value] }))}
        value={outcome}
        leftSection={
          <span style={{ color: outcomeColor[outcome], display: "flex" }}>
            <OutcomeSign outcome={outcome} />
          </span>
        }
        onChange={(next) => setOutcome((next ?? "on_true") as Precondition)}
        w={124}
      />
      <Select
        aria-label="Run"
        placeholder="run …"
        searchable
        autoFocus
        data={targets}
        value={null}
        onChange={(next) => {
          if (next !== null) connect(context.doc, action.key, next, outcome);
          onDone();
        }}
        flex={1}
      />
    </div>
  );
}

export function ArrowList({ action }: { action: Action }) {
  const context = useEditorContext();
  const [connecting, setConnecting] = useState(false);
  const out = context.graph.relations
    .filter((relation) => relation.parent === action.key)
    .sort((a, b) => a.parentOrder - b.parentOrder);
  const first = context.graph.relations.some(
    (relation) => relation.parent === ENTRY && relation.child === action.key,
  );
  return (
    <section className={style.section}>
      <div className={style.heading}>
        <h2>What follows</h2>
        <Button
          size="compact-xs"
          variant="subtle"
          leftSection={<IconPlus size={12} />}
          onClick={() => setConnecting(true)}
        >
          Connect
        </Button>
      </div>
      <ul className="list-reset stack gap-25">
        {out.map((relation) => (
          <Line key={relationId(relation)} relation={relation} context={context} />
        ))}
      </ul>
      {out.length === 0 && !connecting && (
        <p className="m-0 ink2">
          Nothing follows. Drag from one of the four outcomes at the side of the card, or press
          Connect.
        </p>
      )}
      {connecting && <Connect action={action} onDone={() => setConnecting(false)} />}
      <label className={style.check}>
        <input
          type="checkbox"
          checked={first}
          disabled={!context.mayEdit}
          onChange={() =>
            first ? unsetEntry(context.doc, action.key) : setEntry(context.doc, action.key)
          }
        />
        The graph starts with this action
      </label>
    </section>
  );
}
