/**
 * The dialog that flattens a graph with its sub-graphs into one graph, or tells why the result
 * would behave differently.
 */

import { Button, Group, Modal, Skeleton, TextInput } from "@mantine/core";
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { useLocation } from "wouter";
import { useGraphNames } from "../api/graph-names";
import { refreshGraphs } from "../api/graphs";
import { errorText } from "../api/http";
import { type FlatGraph, type FlatteningReason, makeFlatGraph, useFlatGraph } from "../api/inside";
import type { EditorContext } from "../edit-actions/editor-context";
import { copyNameOf } from "../graph/edit/clip";
import { counted } from "../words/counted";
import style from "./levels.module.css";
import { MOST, ReasonList, wayWords } from "./reason-list";

interface Props {
  context: EditorContext;
  onClose: () => void;
}

function Reasons({ reasons, context, onClose }: Props & { reasons: readonly FlatteningReason[] }) {
  return (
    <>
      <p>A flattened graph would behave differently from this one, so none is made:</p>
      <ReasonList label="Why the graph cannot be flattened" {...{ reasons, context, onClose }} />
    </>
  );
}

function Origins({ flat: { origins, left_out } }: { flat: FlatGraph }) {
  const more = origins.length - MOST;
  return (
    <>
      <p>
        It has {counted(origins.length, "action")}. It does what this graph does together with the
        graphs inside it, as they are now: the same actions with the same values, in the same order,
        with the same end.
      </p>
      <ul className={style.list} aria-label="Where its actions come from">
        {origins.slice(0, MOST).map(({ key, action, levels }) => (
          <li key={key}>
            <b>
              <bdi>{action}</bdi>
            </b>
            {levels.length > 1 && <bdi className="quiet-xs">{wayWords(levels)}</bdi>}
          </li>
        ))}
        {more > 0 && <li className="quiet-xs">and {more} more</li>}
      </ul>
      {left_out.length > 0 && (
        <p className="quiet-xs">
          These entries belong to no action of the flattened graph:{" "}
          {left_out
            .map(({ levels, fields }) => `${fields.join(", ")} of ${wayWords(levels)}`)
            .join("; ")}
          .
        </p>
      )}
    </>
  );
}

function FlatForm({ flat, context, onClose }: Props & { flat: FlatGraph }) {
  const client = useQueryClient();
  const [, go] = useLocation();
  const [wrong, setWrong] = useState("");
  const [busy, setBusy] = useState(false);
  const [typed, setName] = useState<string | null>(null);
  const taken = useGraphNames().data?.map((each) => each.name) ?? [];
  const name = typed ?? copyNameOf(context.graph.name, "flat", taken);
  const make = async () => {
    setBusy(true);
    try {
      const made = await makeFlatGraph(context.id, { seq: flat.seq, name });
      await refreshGraphs(client);
      onClose();
      go(`/graphs/${made.id}`);
    } catch (error) {
      setWrong(errorText(error));
      setBusy(false);
    }
  };
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        void make();
      }}
    >
      <Origins flat={flat} />
      <TextInput
        label="Name of the new graph"
        description="This graph stays as it is."
        maxLength={200}
        required
        value={name}
        error={wrong || undefined}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Group justify="flex-end" gap="sm" mt="lg">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" loading={busy}>
          Make it
        </Button>
      </Group>
    </form>
  );
}

export function FlatDialog({ context, onClose }: Props) {
  const flat = useFlatGraph(context.id);
  const { mayEdit } = context;
  return (
    <Modal opened onClose={onClose} title="One graph without graphs inside" size="36rem">
      {flat.isPending && <Skeleton height={180} />}
      {flat.isError && <p role="alert">{errorText(flat.error)}</p>}
      {flat.data?.umrf === null && (
        <Reasons reasons={flat.data.reasons ?? []} {...{ context, onClose }} />
      )}
      {flat.data?.umrf &&
        (mayEdit ? (
          <FlatForm flat={flat.data} {...{ context, onClose }} />
        ) : (
          <Origins flat={flat.data} />
        ))}
    </Modal>
  );
}
