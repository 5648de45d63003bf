/** Drawing an arrow without a pointer: from what, after which outcome, to what. */
import { Button, Modal } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconFlag, IconPlayerPlay, IconPlus, IconSquareRounded } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import { OUTCOMES, OutcomeSign, outcomeColor, outcomeWord } from "../../canvas/outcome";
import { addActionAt, type EditorContext, freePosition } from "../../edit-actions/editor-context";
import { endsOf } from "../../graph/document-keys";
import { asOneEdit, connect, moveRelation, type NewAction } from "../../graph/edit";
import { ENTRY, EXIT, type Key, type Precondition } from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { colorOfName } from "../../ui/name-colors";
import { matching, type Option, PickList } from "../../ui/pick-list";
import { candidates } from "../canvas/quick-add";
import style from "./arrow-dialog.module.css";

/** Everything an arrow can lead from or to, those that are near first. */
function ends(context: EditorContext, end: typeof ENTRY | typeof EXIT, near: Key | null): Option[] {
  const places = context.positions();
  const [x0, y0] = (near === null ? null : places.get(near)) ?? context.view.middle();
  const far = (key: Key) => {
    const [x, y] = places.get(key) ?? [0, 0];
    return Math.hypot(x - x0, y - y0);
  };
  const actions = [...context.graph.actions].sort((a, b) => far(a.key) - far(b.key));
  return [
    ...actions.map(
      ({ key, name, instanceId, actor }): Option => ({
        id: key,
        label: `${name} ${instanceId}`,
        ...(actor === "" ? {} : { sub: actor }),
        icon: <IconSquareRounded size={16} aria-hidden style={{ color: colorOfName(actor) }} />,
      }),
    ),
    end === ENTRY
      ? { id: ENTRY, label: "Entry", icon: <IconPlayerPlay size={16} aria-hidden /> }
      : { id: EXIT, label: "Exit", icon: <IconFlag size={16} aria-hidden /> },
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

function OutcomePicker({ onPick }: { onPick: (outcome: Precondition) => void }) {
  const row = useRef<HTMLDivElement>(null);
  const [at, setAt] = useState(0);
  const press = useRef<(event: KeyboardEvent) => boolean>(() => false);
  press.current = ({ key }) => {
    const chosen = LETTERS[key.toLowerCase()];
    const step = STEPS[key];
    if (chosen) onPick(chosen);
    else if (step) setAt((at + step + OUTCOMES.length) % OUTCOMES.length);
    return Boolean(chosen || step);
  };
  // Heard at once, also before the dialog has the focus: people type faster than it opens.
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
          // Where the dialog puts the focus once it has opened.
          data-autofocus={i === at || undefined}
          onFocus={() => setAt(i)}
          onClick={() => onPick(outcome)}
          leftSection={<OutcomeSign outcome={outcome} />}
          rightSection={<span className={style.digit}>{i + 1}</span>}
          style={{ color: outcomeColor[outcome] }}
        >
          {outcomeWord[outcome]}
        </Button>
      ))}
    </div>
  );
}

interface Props {
  context: EditorContext;
  /** Actions of other graphs, found by their names as where one is added. */
  known: readonly NewAction[];
  from: Key | null;
  to: Key | null;
  onClose: () => void;
}

const FRESH = "new ";

/** What follows may be on the canvas, in the library, or nowhere yet. */
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
      label: isNew ? `New action “${template.name}”` : template.name,
      sub: isNew ? "" : `one more of the library · ${template.description ?? ""}`,
      icon: <IconPlus size={16} aria-hidden />,
    };
  });
  return [...found, ...fresh];
}

export function ArrowDialog({ context, known, from: given, to, onClose }: Props) {
  const [from, setFrom] = useState(given);
  const [outcome, setOutcome] = useState<Precondition | null>(given === ENTRY ? "on_true" : null);
  const draw = (parent: Key, child: Key, when: Precondition) => {
    const name = child.startsWith(FRESH) ? child.slice(FRESH.length) : null;
    const template = known.find((each) => each.name === name) ?? { name: name ?? "" };
    const relation = asOneEdit(context.doc, () => {
      const key = name === null ? child : addActionAt(context, template, freePosition(context));
      return connect(context.doc, parent, key, when);
    });
    onClose();
    if (relation !== null) context.select([relation]);
    else notifications.show({ color: "red", message: "No arrow can lead there." });
  };
  const chooseFrom = (key: Key) => {
    setFrom(key);
    if (key === ENTRY && to !== null && to !== EXIT) draw(ENTRY, to, "on_true");
    else if (key === ENTRY) setOutcome("on_true");
  };
  const chooseOutcome = (when: Precondition) => {
    if (from !== null && to !== null) draw(from, to, when);
    else setOutcome(when);
  };
  const step = from === null ? "from" : outcome === null ? "outcome" : "to";
  const name = from === null ? "…" : endName(context.graph, from);
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
      {step === "from" && (
        <PickList
          key="from"
          label="From"
          placeholder="From which action?"
          find={(search) => matching(ends(context, ENTRY, null), search)}
          onPick={chooseFrom}
          none="No action is called so."
        />
      )}
      {step === "outcome" && <OutcomePicker onPick={chooseOutcome} />}
      {step === "to" && from !== null && outcome !== null && (
        <PickList
          key="to"
          label="To"
          placeholder="What follows?"
          find={targets}
          onPick={(key) => draw(from, key, outcome)}
          none="No action is called so."
          take="draw"
        />
      )}
    </Modal>
  );
}

/** Leads an arrow, with all that it says, from or to another action. */
export function RetargetDialog({
  context,
  relation,
  onClose,
}: {
  context: EditorContext;
  relation: string;
  onClose: () => void;
}) {
  const [end, setEnd] = useState<"parent" | "child">("child");
  const now = endsOf(relation);
  if (now === null) return null;
  const lead = (key: Key) => {
    const moved = moveRelation(context.doc, relation, { [end]: key });
    onClose();
    if (moved !== null) context.select([moved]);
    else {
      notifications.show({
        color: "red",
        title: "The arrow stays",
        message: "These two are tied already, or no arrow can lead there.",
      });
    }
  };
  const options = ends(context, end === "child" ? EXIT : ENTRY, now[end]).filter(
    ({ id }) => id !== now[end] && (id === EXIT || id !== ENTRY || now.parent === ENTRY),
  );
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
      <div className={style.outcomes}>
        <Button
          variant={end === "child" ? "light" : "default"}
          aria-pressed={end === "child"}
          onClick={() => setEnd("child")}
        >
          to another than {endName(context.graph, now.child)}
        </Button>
        {now.parent !== ENTRY && (
          <Button
            variant={end === "parent" ? "light" : "default"}
            aria-pressed={end === "parent"}
            onClick={() => setEnd("parent")}
          >
            from another than {endName(context.graph, now.parent)}
          </Button>
        )}
      </div>
      <PickList
        key={end}
        label={end === "child" ? "To" : "From"}
        placeholder={end === "child" ? "What follows instead?" : "After which action instead?"}
        find={(search) => matching(options, search)}
        onPick={lead}
        none="No action is called so."
        take="lead there"
      />
    </Modal>
  );
}
