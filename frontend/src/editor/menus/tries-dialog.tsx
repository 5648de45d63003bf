/** The dialog that draws further tries of an action, with a sentence of what is drawn. */
import { Button, Checkbox, Group, Modal, NativeSelect } from "@mantine/core";
import { useState } from "react";
import { unplaced } from "../../canvas/geometry/arrange";
import type { EditorContext } from "../../edit-actions/editor-context";
import { asOneEdit, moveLoose } from "../../graph/edit";
import {
  drawTries,
  type Failures,
  MOST_TRIES,
  triesWords,
  whyNoTries,
} from "../../graph/edit/tries";
import type { Key } from "../../graph/model";
import { nameOf } from "../../graph/relation-words";
import { announcer } from "../../ui/announcer";
import { isolated } from "../../words/isolated";
import { freeShifts, sayNothingDrawn } from "./copy-places";

interface Props {
  context: EditorContext;
  action: Key;
  onClose: () => void;
}

const TIMES = Array.from({ length: MOST_TRIES - 1 }, (_, i) => ({
  value: String(i + 2),
  label: `${i + 2} times`,
}));

/** Draws the tries beside the action; everything else stays where it is drawn. */
function drawBeside(context: EditorContext, action: Key, times: number, failures: Failures) {
  const { doc, graph } = context;
  const places = context.positions();
  const [x, y] = places.get(action) ?? context.view.middle();
  const by = freeShifts(context, new Set([action]), times - 1, "across");
  return asOneEdit(doc, () => {
    moveLoose(doc, graph.direction, unplaced(graph, places));
    return drawTries(doc, action, {
      failures,
      places: by.map(([dx, dy]) => [x + dx, y + dy] as const),
    });
  });
}

function TriesForm({ context, action, onClose }: Props) {
  const { graph } = context;
  const [times, setTimes] = useState(3);
  const [onFalse, setOnFalse] = useState(false);
  const failures: Failures = onFalse ? ["on_error", "on_false"] : ["on_error"];
  const submit = () => {
    const made = drawBeside(context, action, times, failures);
    onClose();
    if (made === null || made.length === 0) return sayNothingDrawn();
    context.select([action, ...made]);
    requestAnimationFrame(() => context.view.show([action, ...made]));
    announcer.say(`${made.length} more drawn.`);
  };
  return (
    <form
      className="stack gap-75"
      onSubmit={(event) => {
        event.preventDefault();
        submit();
      }}
    >
      <NativeSelect
        label="Try it up to"
        value={String(times)}
        data={TIMES}
        data-autofocus
        onChange={(event) => setTimes(Number(event.currentTarget.value))}
      />
      <Checkbox
        size="md"
        label="Also when it ends false"
        checked={onFalse}
        onChange={(event) => setOnFalse(event.currentTarget.checked)}
      />
      <p className="m-0 ink2" aria-live="polite">
        {triesWords(graph, action, times, failures)}
      </p>
      <Group justify="flex-end" gap="sm">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled">
          Draw it
        </Button>
      </Group>
    </form>
  );
}

export function TriesDialog({ context, action, onClose }: Props) {
  const { graph, store } = context;
  const named = graph.actions.find(({ key }) => key === action);
  const isGraph = store.graphsInside.now()?.byName.has(named?.name ?? "") ?? false;
  const why = whyNoTries(graph, action, isGraph);
  const title = `Try ${isolated(nameOf(graph, action))} again`;
  return (
    <Modal opened onClose={onClose} title={title} size="28rem">
      {why === null ? (
        <TriesForm {...{ context, action, onClose }} />
      ) : (
        <div className="stack gap-75">
          <p className="m-0">It cannot be drawn so that the engine tries it again. {why}</p>
          <Group justify="flex-end">
            <Button onClick={onClose} data-autofocus>
              Close
            </Button>
          </Group>
        </div>
      )}
    </Modal>
  );
}
