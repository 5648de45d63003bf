/** Dialogs that draw an arrow, or lead one to another action, by keyboard. */
import { Button, Modal } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconFlag, IconPlayerPlay, IconPlus, IconSquareRounded } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import { OUTCOMES, OutcomeSign, outcomeColor, outcomeWord } from "../../canvas/outcome";
import { addActionAt, type EditorContext, freePosition } from "../../edit-actions/editor-context";
import { relationId } from "../../graph/document-keys";
import { asOneEdit, connect, type NewAction } from "../../graph/edit";
import {
  type Action,
  ENTRY,
  EXIT,
  type Key,
  type Precondition,
  type Relation,
  spokenOutcomes,
} from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { keyOf, typedCharacter } from "../../ui/keys";
import { colorOfName } from "../../ui/name-colors";
import { matching, type Option, PickList } from "../../ui/pick-list";
import { useTypedAhead } from "../../ui/typed-ahead";
import { isolated } from "../../words/isolated";
import { candidates } from "../canvas/quick-add";
import { leadElsewhere } from "../canvas/use-line-editing";
import style from "./arrow-dialog.module.css";

/**
 * Return all actions, and entry or exit, from or to which an arrow can lead; those near an action
 * come first.
 */
function ends(context: EditorContext, end: typeof ENTRY | typeof EXIT, near: Key | null): Option[] {
  const places = context.positions();
  const [x0, y0] = (near === null ? null : places.get(near)) ?? context.view.middle();
  const far = (key: Key) => {
    const [x, y] = places.get(key) ?? [0, 0];
    return Math.hypot(x - x0, y - y0);
  };
  const actions = [...context.graph.actions].sort((a, b) => far(a.key) - far(b.key));
  const optionOf = ({ key, actor }: Action): Option => ({
    id: key,
    label: endName(context.graph, key),
    ...(actor === "" ? {} : { sub: actor }),
    icon: <IconSquareRounded size={16} aria-hidden style={{ color: colorOfName(actor) }} />,
  });
  // An arrow from an action to itself is rare: it comes last.
  const itself = actions.filter(({ key }) => key === near).map(optionOf);
  const others = actions.filter(({ key }) => key !== near).map(optionOf);
  return [
    ...others,
    end === ENTRY
      ? { id: ENTRY, label: "Entry", icon: <IconPlayerPlay size={16} aria-hidden /> }
      : { id: EXIT, label: "Exit", icon: <IconFlag size={16} aria-hidden /> },
    ...itself,
  ];
}

const LETTERS: Readonly<Record<string, Precondition>> = {
  "1": "on_true",
  "2": "on_false",
  "3": "on_error",
  "4": "on_stopped",
  t: "on_true",
  f: "on_false",
  e: "on_error",
  s: "on_stopped",
};

const STEPS: Record<string, number> = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 };

/** Return the content and style of an outcome's button, with the digit that chooses it. */
const faceOf = (outcome: Precondition, i: number) => ({
  leftSection: <OutcomeSign outcome={outcome} />,
  rightSection: <span className="no-finger ink3 text-11 weight-500">{i + 1}</span>,
  style: { color: outcomeColor[outcome] },
  children: outcomeWord[outcome],
});

function OutcomePicker({ onPick }: { onPick: (outcome: Precondition) => void }) {
  const row = useRef<HTMLDivElement>(null);
  const [at, setAt] = useState(0);
  const press = useRef<(event: KeyboardEvent) => boolean>(() => false);
  press.current = (event) => {
    const key = keyOf(event);
    const chosen = LETTERS[key.toLowerCase()];
    const step = STEPS[key];
    if (chosen) onPick(chosen);
    else if (step) setAt((at + step + OUTCOMES.length) % OUTCOMES.length);
    return Boolean(chosen || step);
  };
  // Listens on the window: people may type before the dialog has the focus.
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (event.ctrlKey || event.metaKey || event.altKey || !press.current(event)) return;
      event.preventDefault();
      event.stopPropagation();
    };
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  }, []);
  useEffect(() => row.current?.querySelectorAll("button")[at]?.focus(), [at]);
  return (
    // biome-ignore lint/a11y/useSemanticElements: a fieldset cannot be laid out as a row everywhere
    <div ref={row} role="group" aria-label="Outcome" className={style.outcomes}>
      {OUTCOMES.map((outcome, i) => (
        <Button
          key={outcome}
          // the dialog focuses this button once it has opened
          data-autofocus={i === at || undefined}
          onFocus={() => setAt(i)}
          onClick={() => onPick(outcome)}
          {...faceOf(outcome, i)}
        />
      ))}
    </div>
  );
}

/** Shows the chosen outcome while the focus stays in the field for the next action. */
function OutcomeRow({
  value,
  onPick,
}: {
  value: Precondition;
  onPick: (to: Precondition) => void;
}) {
  return (
    <div role="radiogroup" aria-label="Outcome" className={style.outcomes}>
      {OUTCOMES.map((outcome, i) => (
        <Button
          key={outcome}
          role="radio"
          aria-checked={outcome === value}
          variant={outcome === value ? "light" : "default"}
          tabIndex={outcome === value ? 0 : -1}
          onClick={() => onPick(outcome)}
          onKeyDown={(event) => {
            const next = stepped(value, keyOf(event));
            if (next === null) return;
            event.preventDefault();
            onPick(next);
            const row = event.currentTarget.parentElement;
            row?.querySelectorAll<HTMLElement>("[role=radio]")[OUTCOMES.indexOf(next)]?.focus();
          }}
          {...faceOf(outcome, i)}
        />
      ))}
    </div>
  );
}

function stepped(outcome: Precondition, key: string): Precondition | null {
  const step = STEPS[key];
  if (step === undefined) return null;
  return OUTCOMES[(OUTCOMES.indexOf(outcome) + step + OUTCOMES.length) % OUTCOMES.length] ?? null;
}

/**
 * Return the outcome that a digit or arrow key chooses while the field is empty: no name begins
 * with these; null for other keys.
 */
function outcomeByKey(now: Precondition, event: React.KeyboardEvent): Precondition | null {
  const key = keyOf(event);
  if (key >= "1" && key <= "4") return OUTCOMES[Number(key) - 1] ?? null;
  return key === "ArrowLeft" || key === "ArrowRight" ? stepped(now, key) : null;
}

/**
 * Return a function for the letters typed before the dialog has opened: people type faster than it
 * opens, and on the canvas the same keys are shortcuts.
 */
function useEarlyKeys(onOutcome: (outcome: Precondition) => void): () => string {
  const early = useRef("");
  const tell = useRef(onOutcome);
  tell.current = onOutcome;
  useTypedAhead(useRef<HTMLElement>(null), (text) => {
    const outcome = OUTCOMES[Number(text[0]) - 1];
    if (outcome) tell.current(outcome);
    early.current = outcome ? text.slice(1) : text;
  });
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const inField = event.target instanceof HTMLElement && event.target.matches("input, button");
      const typed = typedCharacter(event);
      if (inField || event.ctrlKey || event.metaKey || event.altKey || typed === "") return;
      const field = document.querySelector<HTMLElement>("[role=dialog] [role=combobox]");
      event.stopPropagation();
      // The key writes into the element that has the focus now.
      if (field !== null) field.focus();
      else {
        event.preventDefault();
        const digit = early.current === "" && OUTCOMES[Number(keyOf(event)) - 1];
        if (digit) tell.current(digit);
        else early.current += typed;
      }
    };
    window.addEventListener("keydown", onKey, { capture: true });
    return () => window.removeEventListener("keydown", onKey, { capture: true });
  }, []);
  return () => early.current;
}

interface ArrowDialogProps {
  context: EditorContext;
  /** Actions of the library and of other graphs, which can be added as the next action. */
  known: readonly NewAction[];
  from: Key | null;
  to: Key | null;
  onClose: () => void;
}

const FRESH = "new ";

function originOf({ ofGraph, title }: NewAction): string {
  if (ofGraph) return "a graph";
  return title === undefined ? "another use, from the library" : "ready-made";
}

/** Return matching targets: on the canvas, in the library, or an action that is new. */
export function targetsOf(
  here: readonly Option[],
  known: readonly NewAction[],
  search: string,
): readonly Option[] {
  const found = matching(here, search);
  if (search.trim() === "") return found;
  const fresh = candidates(known, search).map((template): Option => {
    const isNew = !known.includes(template);
    return {
      id: FRESH + template.name,
      label: isNew ? `New action “${isolated(template.name)}”` : (template.title ?? template.name),
      sub: isNew ? "" : `${originOf(template)} · ${template.description ?? ""}`,
      icon: <IconPlus size={16} aria-hidden />,
    };
  });
  return [...found, ...fresh];
}

/** Shows in words the arrow that will be drawn, as far as it is chosen. */
function Sentence({ context, from, outcome, to }: SentenceProps) {
  const name = from === null ? "…" : endName(context.graph, from);
  return (
    <p className={style.sentence} aria-live="polite">
      {from === ENTRY ? (
        "At the start, run …"
      ) : (
        <>
          When <b>{name}</b> is{" "}
          {outcome === null ? (
            "…"
          ) : (
            <b className={style.said} style={{ color: outcomeColor[outcome] }}>
              <OutcomeSign outcome={outcome} /> {outcomeWord[outcome]}
            </b>
          )}
          , run {to === null ? "…" : <b>{endName(context.graph, to)}</b>}
        </>
      )}
    </p>
  );
}

interface SentenceProps {
  context: EditorContext;
  from: Key | null;
  outcome: Precondition | null;
  to: Key | null;
}

/** Draws the arrow, with a new action if the target is not on the canvas, and selects it. */
function draw(
  { context, known, onClose }: Pick<ArrowDialogProps, "context" | "known" | "onClose">,
  parent: Key,
  child: Key,
  when: Precondition,
): void {
  const name = child.startsWith(FRESH) ? child.slice(FRESH.length) : null;
  const template = known.find((each) => each.name === name) ?? { name: name ?? "" };
  const relation = asOneEdit(context.doc, () => {
    const key = name === null ? child : addActionAt(context, template, freePosition(context));
    return connect(context.doc, parent, key, when);
  });
  onClose();
  if (relation !== null) context.select([relation]);
  else notifications.show({ color: "red", message: "No arrow can lead there." });
}

export function ArrowDialog(props: ArrowDialogProps) {
  const { context, known, from: given, to, onClose } = props;
  const [from, setFrom] = useState(given);
  const [outcome, setOutcome] = useState<Precondition>("on_true");
  const early = useEarlyKeys(setOutcome);
  const chooseFrom = (key: Key) => {
    setFrom(key);
    if (key === ENTRY && to !== null && to !== EXIT) draw(props, ENTRY, to, "on_true");
  };
  const step = from === null ? "from" : to !== null ? "outcome" : "to";
  const targets = (search: string): readonly Option[] => {
    const all = ends(context, EXIT, from).filter(({ id }) => from !== ENTRY || id !== EXIT);
    return targetsOf(all, known, search);
  };
  return (
    <Modal
      opened
      onClose={onClose}
      title="Draw an arrow"
      yOffset="14vh"
      centered={false}
      transitionProps={{ duration: 80 }}
      overlayProps={{ backgroundOpacity: 0.3 }}
    >
      <Sentence context={context} from={from} outcome={to === null ? outcome : null} to={to} />
      {step === "from" && (
        <PickList
          key="from"
          label="From"
          placeholder="From which action?"
          initial={early}
          find={(search) => matching(ends(context, ENTRY, null), search)}
          onPick={chooseFrom}
          none="No action has this name."
        />
      )}
      {step === "outcome" && from !== null && to !== null && (
        <OutcomePicker onPick={(when) => draw(props, from, to, when)} />
      )}
      {step === "to" && from !== null && (
        <>
          {from !== ENTRY && <OutcomeRow value={outcome} onPick={setOutcome} />}
          <PickList
            key="to"
            label="To"
            placeholder="What follows?"
            {...(given === null ? {} : { initial: early })}
            find={targets}
            onPick={(key) => draw(props, from, key, outcome)}
            onEmptyKey={(event) => {
              const next = from === ENTRY ? null : outcomeByKey(outcome, event);
              if (next !== null) setOutcome(next);
              return next !== null;
            }}
            none="No action has this name."
            take="draw"
          />
        </>
      )}
    </Modal>
  );
}

type RelationEnd = "parent" | "child";

interface RetargetProps {
  context: EditorContext;
  relation: string;
  /** The only outcome to move; without it all of them move together. */
  outcome?: Precondition;
  onClose: () => void;
}

/** Asks whether all outcomes of an arrow move or one of them. */
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

/** Asks which end of the arrow moves. */
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

/** Return the actions to which this end can move. */
function placesFor(context: EditorContext, relation: Relation, end: RelationEnd): Option[] {
  const now = relation[end];
  return ends(context, end === "child" ? EXIT : ENTRY, now).filter(
    ({ id }) => id !== now && (id === EXIT || id !== ENTRY || relation.parent === ENTRY),
  );
}

export function RetargetDialog({ context, relation: id, outcome, onClose }: RetargetProps) {
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
        none="No action has this name."
        take="lead there"
      />
    </Modal>
  );
}
