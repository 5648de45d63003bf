/** Dialogs that make a sub-graph of selected actions, and that unpack a sub-graph in place of its action. */

import { Button, Group, Modal, Skeleton, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo, useRef, useState } from "react";
import { refreshGraphs, refreshLibrary } from "../api/graphs";
import { errorText } from "../api/http";
import {
  type ExtractionLook,
  type FlatteningReason,
  lookAtExtraction,
  lookAtUnpacking,
  makeSubGraph,
  type UnpackingLook,
} from "../api/inside";
import { useGraphsAsActions, useLibrary } from "../api/library";
import { unplaced } from "../canvas/geometry/arrange";
import type { EditorContext } from "../edit-actions/editor-context";
import { newAid, rootOf, splitKey } from "../graph/document-keys";
import { asOneEdit, moveLoose } from "../graph/edit";
import {
  applyActionChanges,
  collisionsOfActions,
  type DocumentChange,
  places,
} from "../graph/edit/key-changes";
import type { Key, Position } from "../graph/model";
import { announcer } from "../ui/announcer";
import { useStableCallback } from "../ui/hooks";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./levels.module.css";
import { ReasonList } from "./reason-list";

/** Return the keys of actions that these changes add or remove. */
function actionsOf(changes: readonly DocumentChange[], fits: (change: DocumentChange) => boolean) {
  const own = changes.filter(({ root, key }) => root === "actions" && splitKey(key).rest === "");
  return own.filter(fits).map(({ key }) => key);
}

const within = (place: Position | undefined) => (place === undefined ? [] : [place]);

function middleOf(places: readonly Position[]): Position | null {
  if (places.length === 0) return null;
  const [xs, ys] = [places.map(([x]) => x), places.map(([, y]) => y)];
  const mean = (all: number[]) => Math.round((Math.min(...all) + Math.max(...all)) / 2);
  return [mean(xs), mean(ys)];
}

/**
 * Applies the changes as one edit, which one undo reverts, and shows the new actions. Everything
 * else stays where it is drawn.
 */
function makeActionEdit(context: EditorContext, changes: readonly DocumentChange[]): void {
  const { doc, graph } = context;
  const places = context.positions();
  const gone = new Set<Key>(actionsOf(changes, ({ after }) => after === undefined));
  const fresh = actionsOf(changes, ({ before }) => before === undefined);
  const middle = middleOf([...gone].flatMap((key) => within(places.get(key))));
  asOneEdit(doc, () => {
    moveLoose(
      doc,
      graph.direction,
      unplaced(graph, places).filter(([key]) => !gone.has(key)),
    );
    applyActionChanges(doc, changes);
    const positions = rootOf(doc, "positions");
    for (const key of fresh) if (middle && !positions.has(key)) positions.set(key, [...middle]);
  });
  context.select(fresh);
  requestAnimationFrame(() => context.view.show(fresh));
}

/** Return a name for the new graph that is not taken and is valid as a C++ class. */
function subGraphName(first: string, taken: ReadonlySet<string>): string {
  const stem = `${first.replace(/\W/g, "").replace(/^\d+/, "") || "New"}Steps`;
  for (let n = 1; ; n += 1) {
    const name = n === 1 ? stem : `${stem}${n}`;
    if (!taken.has(name)) return name;
  }
}

interface ExtractProps {
  context: EditorContext;
  actions: readonly Key[];
  onClose: () => void;
}

/** Return all names that are taken by graphs and by actions of the library or of any graph. */
function useTakenNames({ graph }: EditorContext): ReadonlySet<string> {
  const { data: known = [] } = useLibrary();
  const { data: graphs = [] } = useGraphsAsActions();
  return useMemo(() => {
    const names = [...known, ...graphs, ...graph.actions].map(({ name }) => name);
    return new Set([graph.name, ...names]);
  }, [known, graphs, graph]);
}

/** Return a function that keeps of a way only the action in this graph. */
function ofGraph({ graph }: EditorContext) {
  const there = new Set(graph.actions.map(({ key }) => key));
  return (way: NonNullable<FlatteningReason["at"]>) =>
    way.filter(({ key }) => there.has(key)).slice(-1);
}

function ParameterLists({ look: { inputs = {}, outputs = {} } }: { look: ExtractionLook }) {
  const sides = [
    ["Takes", inputs],
    ["Gives", outputs],
  ] as const;
  return (
    <dl className={style.sides}>
      {sides.map(([word, side]) => (
        <div key={word}>
          <dt className="quiet-xs">{word}</dt>
          <dd className="m-0 stack break-anywhere">
            {Object.keys(side).length === 0 && <span className="quiet-xs">nothing</span>}
            {Object.entries(side).map(([name, type]) => (
              <span key={name} className={style.side}>
                <bdi>{name.replaceAll("::", ".")}</bdi> <bdi className="quiet-xs">{type}</bdi>
              </span>
            ))}
          </dd>
        </div>
      ))}
    </dl>
  );
}

/**
 * Return a function that makes the new graph on the server and then edits this one, unless it has
 * changed since the preview. It returns the reason for a failure, else null.
 */
function useMaking(context: EditorContext, look: ExtractionLook, again: () => Promise<unknown>) {
  const client = useQueryClient();
  const meanwhile = (changes: ExtractionLook["changes"]) =>
    places(context.graph, collisionsOfActions(context.doc, changes ?? [])).join(", ");
  return async (actions: readonly Key[], name: string): Promise<string | null> => {
    const changed = meanwhile(look.changes);
    if (changed !== "") {
      await again();
      return `Changed meanwhile: ${changed}. Look at it again.`;
    }
    const otherwise = (look.differences ?? []).length > 0;
    const body = { actions: [...actions], name, seq: look.seq, otherwise };
    const made = await makeSubGraph(context.id, body);
    await Promise.all([refreshGraphs(client), refreshLibrary(client)]);
    const late = meanwhile(made.changes);
    if (late !== "")
      return `The graph “${isolated(name)}” is made, but the actions also stay here, because somebody changed them meanwhile: ${late}.`;
    makeActionEdit(context, made.changes);
    notifications.show({
      title: `“${isolated(name)}” is a graph of its own now`,
      message: `If you undo this, the actions return to this graph; “${isolated(name)}” stays in the list of graphs.`,
    });
    return null;
  };
}

function ExtractForm({ look, again, ...props }: ExtractProps & PreviewProps) {
  const { context, actions, onClose } = props;
  const taken = useTakenNames(context);
  const first = context.graph.actions.find(({ key }) => actions.includes(key))?.name ?? "";
  const [typed, setTyped] = useState<string | null>(null);
  const [wrong, setWrong] = useState("");
  const [busy, setBusy] = useState(false);
  const name = typed ?? subGraphName(first, taken);
  const differences = look.differences ?? [];
  const make = useMaking(context, look, again);
  const field = useRef<HTMLInputElement>(null);
  // The field is rendered when the dialog has the focus already.
  useEffect(() => field.current?.select(), []);
  const submit = async () => {
    setBusy(true);
    try {
      const failed = await make(actions, name.trim());
      if (failed === null) return onClose();
      setWrong(failed);
    } catch (error) {
      setWrong(errorText(error));
    }
    setBusy(false);
  };
  const isTaken = taken.has(name.trim());
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (!isTaken) void submit();
      }}
    >
      <TextInput
        label="Name of the new graph"
        description="The action that stands for it here gets the same name."
        maxLength={200}
        required
        ref={field}
        value={name}
        error={isTaken ? "A graph or an action has this name already." : wrong || undefined}
        onChange={(event) => {
          setTyped(event.currentTarget.value);
          setWrong("");
        }}
      />
      <ParameterLists look={look} />
      {differences.length === 0 ? (
        <p className="quiet-xs">
          The new graph does the same as these actions, for every outcome that they can have.
        </p>
      ) : (
        <div className={style.warned}>
          <p>As a sub-graph, the actions may behave differently than they do now:</p>
          <ReasonList
            label="What may be different"
            reasons={differences}
            told={ofGraph(context)}
            {...{ context, onClose }}
          />
        </div>
      )}
      <p className="quiet-xs">
        A robot runs it only if the new graph is in its index. It cannot be paused while that graph
        runs.
      </p>
      <Group justify="flex-end" gap="sm" mt="lg">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" loading={busy} disabled={isTaken}>
          {differences.length === 0 ? "Make it" : "Make it anyway"}
        </Button>
      </Group>
    </form>
  );
}

interface PreviewProps {
  look: ExtractionLook;
  again: () => Promise<unknown>;
}

function ExtractRefusal({ look, context, onClose }: ExtractProps & { look: ExtractionLook }) {
  return (
    <>
      <p>No graph can be made of exactly these actions:</p>
      <ReasonList
        label="Why no sub-graph can be made"
        reasons={look.reasons ?? []}
        told={ofGraph(context)}
        {...{ context, onClose }}
      />
      <Group justify="flex-end" gap="sm" mt="lg">
        <Button onClick={onClose}>Close</Button>
      </Group>
    </>
  );
}

export function ExtractDialog(props: ExtractProps) {
  const { context, actions, onClose } = props;
  // An unused name, so that the preview is only about the actions.
  const [passing] = useState(newAid);
  const { data, error, isPending, refetch } = useQuery({
    queryKey: ["graphs", context.id, "extraction", actions],
    queryFn: () => lookAtExtraction(context.id, { actions: [...actions], name: `G${passing}` }),
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 0,
  });
  return (
    <Modal
      opened
      onClose={onClose}
      title={`A sub-graph of ${counted(actions.length, "action")}`}
      size="32rem"
    >
      {isPending && <Skeleton height={180} />}
      {error !== null && <p role="alert">{errorText(error)}</p>}
      {data?.umrf === null && <ExtractRefusal look={data} {...props} />}
      {data?.umrf && <ExtractForm look={data} again={refetch} {...props} />}
    </Modal>
  );
}

interface UnpackProps {
  context: EditorContext;
  action: Key;
  onClose: () => void;
}

function failed(message: string): void {
  notifications.show({ color: "red", title: "Not unpacked", message, autoClose: 12_000 });
}

/** Applies the edit, unless others have changed the action meanwhile. */
function unpack(context: EditorContext, look: UnpackingLook): void {
  const changes = look.changes ?? [];
  const changed = places(context.graph, collisionsOfActions(context.doc, changes));
  if (changed.length > 0) {
    failed(`Changed meanwhile: ${changed.join(", ")}.`);
    return;
  }
  makeActionEdit(context, changes);
  const count = (look.actions ?? []).length;
  announcer.say(`Unpacked into ${counted(count, "action")}`);
}

function UnpackQuestion({ look, context, onClose, name }: UnpackQuestionProps) {
  const { differences = [], reasons = [], left_out: left = [] } = look;
  const refused = reasons.length > 0;
  const told = refused ? reasons : differences;
  return (
    <>
      {told.length > 0 && (
        <p>
          {refused
            ? "Its actions would behave differently outside of it, so nothing is unpacked:"
            : "Outside of it, its actions may behave differently:"}
        </p>
      )}
      <ReasonList label="What would be different" reasons={told} {...{ context, onClose }} />
      {left.length > 0 && (
        <p className="quiet-xs">
          These entries belong to no action after unpacking: {left.map(isolated).join(", ")} of{" "}
          <bdi>{name}</bdi>.
        </p>
      )}
      <Group justify="flex-end" gap="sm" mt="lg">
        <Button onClick={onClose}>{refused ? "Close" : "Cancel"}</Button>
        {!refused && (
          <Button
            variant="filled"
            onClick={() => {
              onClose();
              unpack(context, look);
            }}
          >
            {told.length > 0 ? "Unpack it anyway" : "Unpack it"}
          </Button>
        )}
      </Group>
    </>
  );
}

interface UnpackQuestionProps extends Omit<UnpackProps, "action"> {
  look: UnpackingLook;
  name: string;
}

export function UnpackDialog({ context, action, onClose }: UnpackProps) {
  const [look, setLook] = useState<UnpackingLook | null>(null);
  const name = context.graph.actions.find(({ key }) => key === action)?.name ?? "";
  const looked = useStableCallback((found: UnpackingLook) => {
    const { differences = [], reasons = [], left_out: left = [] } = found;
    if (differences.length + reasons.length + left.length > 0) {
      setLook(found);
      return;
    }
    onClose();
    unpack(context, found);
  });
  const stopped = useStableCallback((error: unknown) => {
    onClose();
    failed(errorText(error));
  });
  const placeOf = useStableCallback(() => context.positions().get(action));
  useEffect(() => {
    let isOpen = true;
    const at = placeOf();
    const body = { action, ...(at && { at: [...at] as [number, number] }) };
    lookAtUnpacking(context.id, body).then(
      (found) => isOpen && looked(found),
      (error) => isOpen && stopped(error),
    );
    return () => {
      isOpen = false;
    };
  }, [context.id, action, looked, stopped, placeOf]);
  if (look === null) return null;
  return (
    <Modal opened onClose={onClose} title={`Unpack ${isolated(name)}`} size="32rem">
      <UnpackQuestion {...{ look, context, onClose, name }} />
    </Modal>
  );
}
