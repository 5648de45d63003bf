/** A sub-graph of chosen actions: its name, what it takes and gives, and in what it may do otherwise than they do. */
import { Button, Modal, Skeleton, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo, useRef, useState } from "react";
import {
  type ExtractionLook,
  type FlatteningReason,
  lookAtExtraction,
  makeSubGraph,
} from "../api/documents/inside";
import { useGraphsAsActions, useLibrary } from "../api/documents/library";
import { refreshGraphs, refreshLibrary } from "../api/graphs";
import { errorText } from "../api/http";
import type { EditorContext } from "../edit-actions/editor-context";
import { collisionsOfActions, places } from "../graph/edit/key-changes";
import { newAid } from "../graph/ids";
import type { Key } from "../graph/model";
import { isolated } from "../words/isolated";
import style from "./levels.module.css";
import { ReasonList } from "./reason-list";
import { makeActionEdit, subGraphName } from "./subgraph-edits";

interface Props {
  context: EditorContext;
  actions: readonly Key[];
  onClose: () => void;
}

/** What is called something already: a graph, an action of the library or of any graph. */
function useTakenNames({ graph }: EditorContext): ReadonlySet<string> {
  const { data: known = [] } = useLibrary();
  const { data: graphs = [] } = useGraphsAsActions();
  return useMemo(() => {
    const names = [...known, ...graphs, ...graph.actions].map(({ name }) => name);
    return new Set([graph.name, ...names]);
  }, [known, graphs, graph]);
}

/** Of the way to an action: the graph around all of it need not be told. */
function ofGraph({ graph }: EditorContext) {
  const there = new Set(graph.actions.map(({ key }) => key));
  return (way: NonNullable<FlatteningReason["at"]>) =>
    way.filter(({ key }) => there.has(key)).slice(-1);
}

function Sides({ look: { inputs = {}, outputs = {} } }: { look: ExtractionLook }) {
  const sides = [
    ["Takes", inputs],
    ["Gives", outputs],
  ] as const;
  return (
    <dl className={style.sides}>
      {sides.map(([word, side]) => (
        <div key={word}>
          <dt>{word}</dt>
          <dd>
            {Object.keys(side).length === 0 && <span className={style.quiet}>nothing</span>}
            {Object.entries(side).map(([name, type]) => (
              <span key={name} className={style.side}>
                <bdi>{name.replaceAll("::", ".")}</bdi> <bdi className={style.quiet}>{type}</bdi>
              </span>
            ))}
          </dd>
        </div>
      ))}
    </dl>
  );
}

/** The new graph on the server, then one edit here, if what was looked at is still what there is. */
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
      return `The graph “${isolated(name)}” is made, but the actions stay here too: changed meanwhile: ${late}.`;
    makeActionEdit(context, made.changes);
    notifications.show({
      title: `“${isolated(name)}” is a graph of its own now`,
      message: "Undo brings the actions back here; that graph then stays in the list of graphs.",
    });
    return null;
  };
}

function Form({ look, again, ...props }: Props & Looked) {
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
  // It comes when the dialog has the keyboard already.
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
        description="The action that stands for it here is called the same."
        maxLength={200}
        required
        ref={field}
        value={name}
        error={isTaken ? "A graph or an action is called that already." : wrong || undefined}
        onChange={(event) => {
          setTyped(event.currentTarget.value);
          setWrong("");
        }}
      />
      <Sides look={look} />
      {differences.length === 0 ? (
        <p className={style.quiet}>It does what these actions do now, for all of their results.</p>
      ) : (
        <div className={style.warned}>
          <p>As a sub-graph they may do otherwise than in one graph, as now:</p>
          <ReasonList
            label="What may be otherwise"
            reasons={differences}
            told={ofGraph(context)}
            {...{ context, onClose }}
          />
        </div>
      )}
      <p className={style.quiet}>
        A robot runs it only with the new graph in its index, and cannot be paused meanwhile.
      </p>
      <div className={style.answers}>
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" loading={busy} disabled={isTaken}>
          {differences.length === 0 ? "Make it" : "Make it all the same"}
        </Button>
      </div>
    </form>
  );
}

interface Looked {
  look: ExtractionLook;
  again: () => Promise<unknown>;
}

function Refused({ look, context, onClose }: Props & { look: ExtractionLook }) {
  return (
    <>
      <p>No graph can be made of exactly these actions:</p>
      <ReasonList
        label="Why none is made"
        reasons={look.reasons ?? []}
        told={ofGraph(context)}
        {...{ context, onClose }}
      />
      <div className={style.answers}>
        <Button onClick={onClose}>Close</Button>
      </div>
    </>
  );
}

export function ExtractDialog(props: Props) {
  const { context, actions, onClose } = props;
  // A name that nobody has, so that the look is about the actions alone.
  const [passing] = useState(newAid);
  const { data, error, isPending, refetch } = useQuery({
    queryKey: ["graphs", context.id, "extraction", actions],
    queryFn: () => lookAtExtraction(context.id, { actions: [...actions], name: `G${passing}` }),
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 0,
  });
  const count = actions.length === 1 ? "1 action" : `${actions.length} actions`;
  return (
    <Modal opened onClose={onClose} title={`A sub-graph of ${count}`} size="32rem">
      {isPending && <Skeleton height={180} />}
      {error !== null && <p role="alert">{errorText(error)}</p>}
      {data?.umrf === null && <Refused look={data} {...props} />}
      {data?.umrf && <Form look={data} again={refetch} {...props} />}
    </Modal>
  );
}
