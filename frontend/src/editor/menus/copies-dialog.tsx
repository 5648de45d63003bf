/** The dialog that duplicates actions with another value for each copy. */
import { Button, Checkbox, Group, Modal, NativeSelect, Textarea } from "@mantine/core";
import { useMemo, useState } from "react";
import { usePerson } from "../../api/people";
import { unplaced } from "../../canvas/geometry/arrange";
import type { EditorContext } from "../../edit-actions/editor-context";
import { asOneEdit, moveLoose } from "../../graph/edit";
import {
  copiesWords,
  drawCopies,
  MOST_COPIES,
  type Varied,
  variedInputs,
  whyNoSeries,
  wrongValue,
} from "../../graph/edit/series";
import { pathWords } from "../../graph/field-words";
import type { Key } from "../../graph/model";
import { nameOf } from "../../graph/relation-words";
import { announcer } from "../../ui/announcer";
import { textScope, useKeptText } from "../../ui/kept-texts";
import { isolated } from "../../words/isolated";
import { freeShifts, sayNothingDrawn } from "./copy-places";

interface Props {
  context: EditorContext;
  actions: readonly Key[];
  onClose: () => void;
}

const ROBOT = "robot"; // no path: those of inputs begin with "in/"

const linesOf = (draft: string): string[] =>
  draft
    .split("\n")
    .map((line) => line.trim())
    .filter((line) => line !== "");

/** Returns the first fault of the typed values; null when they can be drawn. */
function faultOf(values: readonly string[], wrong: (value: string) => string | null) {
  if (values.length > MOST_COPIES) return `At most ${MOST_COPIES} copies at once.`;
  for (const value of values) {
    const fault = wrong(value);
    if (fault !== null) return fault;
  }
  return null;
}

function drawBeside(
  context: EditorContext,
  keys: ReadonlySet<Key>,
  varied: Varied,
  { values, inSeries }: { values: readonly string[]; inSeries: boolean },
) {
  const { doc, graph } = context;
  const places = context.positions();
  const by = freeShifts(context, keys, values.length, inSeries ? "along" : "across");
  return asOneEdit(doc, () => {
    moveLoose(doc, graph.direction, unplaced(graph, places));
    return drawCopies(doc, keys, varied, { values, inSeries, by, places });
  });
}

export function CopiesDialog({ context, actions, onClose }: Props) {
  const { graph } = context;
  const { person } = usePerson();
  const keys = useMemo(() => new Set(actions), [actions]);
  const own = graph.actions.filter(({ key }) => keys.has(key));
  const inputs = variedInputs(own);
  const [field, setField] = useState(inputs[0] === undefined ? ROBOT : `in/${inputs[0]}`);
  const [draft, setDraft] = useKeptText(`copies ${textScope(context.id, person.id)}`);
  const [wantsSeries, setWantsSeries] = useState(true);
  const varied: Varied =
    field === ROBOT ? { kind: "robot" } : { kind: "input", path: field.slice("in/".length) };
  const values = linesOf(draft);
  const fault = faultOf(values, (value) => wrongValue(own, varied, value));
  const whyNot = whyNoSeries(graph, keys, varied);
  const inSeries = wantsSeries && whyNot === null;
  const isReady = values.length > 0 && fault === null;
  const submit = () => {
    const made = drawBeside(context, keys, varied, { values, inSeries });
    onClose();
    const drawn = (made ?? []).filter((copy) => copy.length > 0);
    if (drawn.length === 0) return sayNothingDrawn();
    setDraft("");
    context.select(drawn.flat());
    requestAnimationFrame(() => context.view.show(drawn.flat()));
    announcer.say(`${drawn.length} ${drawn.length === 1 ? "copy" : "copies"} drawn.`);
  };
  const [only] = actions;
  const what = actions.length === 1 ? nameOf(graph, only ?? "") : `${actions.length} actions`;
  return (
    <Modal opened onClose={onClose} title={`Duplicate ${isolated(what)} with …`} size="28rem">
      <form
        className="stack gap-75"
        onSubmit={(event) => {
          event.preventDefault();
          if (isReady) submit();
        }}
      >
        <NativeSelect
          label="What differs"
          value={field}
          data={[
            ...inputs.map((path) => ({ value: `in/${path}`, label: pathWords(path) })),
            { value: ROBOT, label: "Robot" },
          ]}
          onChange={(event) => setField(event.currentTarget.value)}
        />
        <Textarea
          label="Values, one a line"
          description="Each line makes a copy."
          autosize
          minRows={3}
          maxRows={10}
          value={draft}
          error={fault ?? undefined}
          data-autofocus
          onChange={(event) => setDraft(event.currentTarget.value)}
        />
        <Checkbox
          size="md"
          label="One after another"
          description={whyNot ?? undefined}
          disabled={whyNot !== null}
          checked={inSeries}
          onChange={(event) => setWantsSeries(event.currentTarget.checked)}
        />
        <p className="m-0 ink2" aria-live="polite">
          {isReady && copiesWords(graph, keys, varied, { values, inSeries })}
        </p>
        <Group justify="flex-end" gap="sm">
          <Button onClick={onClose}>Cancel</Button>
          <Button type="submit" variant="filled" disabled={!isReady}>
            Draw it
          </Button>
        </Group>
      </form>
    </Modal>
  );
}
