/** Leading an arrow, or one of its outcomes, from or to another action without a pointer. */
import { Button, Modal } from "@mantine/core";
import { useState } from "react";
import { OutcomeSign, outcomeColor, outcomeWord } from "../../canvas/outcome";
import type { EditorContext } from "../../edit-actions/editor-context";
import { relationId } from "../../graph/document-keys";
import {
  ENTRY,
  EXIT,
  type Key,
  type Precondition,
  type Relation,
  spokenOutcomes,
} from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { matching, type Option, PickList } from "../../ui/pick-list";
import { isolated } from "../../words/isolated";
import { leadElsewhere } from "../canvas/lead-elsewhere";
import { ends } from "./arrow-dialog";
import style from "./arrow-dialog.module.css";

type RelationEnd = "parent" | "child";

interface Props {
  context: EditorContext;
  relation: string;
  /** The one that is led alone; all of them go together without it. */
  outcome?: Precondition;
  onClose: () => void;
}

/** Whether all outcomes of an arrow go together, or one alone. */
function OutcomeChoice({ of, value, onPick }: OutcomeChoiceProps) {
  return (
    // biome-ignore lint/a11y/useSemanticElements: a fieldset cannot be laid out as a row everywhere
    <div role="group" aria-label="What is led elsewhere" className={style.outcomes}>
      <Button
        variant={value === null ? "light" : "default"}
        aria-pressed={value === null}
        onClick={() => onPick(null)}
      >
        All of it
      </Button>
      {of.map((outcome) => (
        <Button
          key={outcome}
          variant={value === outcome ? "light" : "default"}
          aria-pressed={value === outcome}
          leftSection={<OutcomeSign outcome={outcome} />}
          style={{ color: outcomeColor[outcome] }}
          onClick={() => onPick(outcome)}
        >
          {outcomeWord[outcome]}
        </Button>
      ))}
    </div>
  );
}

interface OutcomeChoiceProps {
  of: readonly Precondition[];
  value: Precondition | null;
  onPick: (outcome: Precondition | null) => void;
}

/** Which of its two ends is led elsewhere. */
function EndChoice({ context, relation: { parent, child }, end, onPick }: EndChoiceProps) {
  const button = (which: RelationEnd, label: string) => (
    <Button
      variant={end === which ? "light" : "default"}
      aria-pressed={end === which}
      onClick={() => onPick(which)}
    >
      {label}
    </Button>
  );
  return (
    <div className={style.outcomes}>
      {button("child", `to another than ${isolated(endName(context.graph, child))}`)}
      {parent !== ENTRY &&
        button("parent", `from another than ${isolated(endName(context.graph, parent))}`)}
    </div>
  );
}

interface EndChoiceProps {
  context: EditorContext;
  relation: Relation;
  end: RelationEnd;
  onPick: (end: RelationEnd) => void;
}

/** Where that end can be led. */
function placesFor(context: EditorContext, relation: Relation, end: RelationEnd): Option[] {
  const now = relation[end];
  return ends(context, end === "child" ? EXIT : ENTRY, now).filter(
    ({ id }) => id !== now && (id === EXIT || id !== ENTRY || relation.parent === ENTRY),
  );
}

export function RetargetDialog({ context, relation: id, outcome, onClose }: Props) {
  const [end, setEnd] = useState<RelationEnd>("child");
  const [alone, setAlone] = useState<Precondition | null>(outcome ?? null);
  const relation = context.graph.relations.find((each) => relationId(each) === id);
  if (relation === undefined) return null;
  const outcomes = relation.parent === ENTRY ? [] : spokenOutcomes(relation.conditions);
  const lead = (key: Key) => {
    onClose();
    leadElsewhere(context, id, alone, { [end]: key });
  };
  return (
    <Modal
      opened
      onClose={onClose}
      title="Lead the arrow elsewhere"
      yOffset="14vh"
      centered={false}
      transitionProps={{ duration: 80 }}
      overlayProps={{ backgroundOpacity: 0.3 }}
    >
      {outcomes.length > 1 && <OutcomeChoice of={outcomes} value={alone} onPick={setAlone} />}
      <EndChoice context={context} relation={relation} end={end} onPick={setEnd} />
      <PickList
        key={end}
        label={end === "child" ? "To" : "From"}
        placeholder={end === "child" ? "What follows instead?" : "After which action instead?"}
        find={(search) => matching(placesFor(context, relation, end), search)}
        onPick={lead}
        none="No action is called so."
        take="lead there"
      />
    </Modal>
  );
}
