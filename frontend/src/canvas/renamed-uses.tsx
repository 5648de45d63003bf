/**
 * Asks after a graph was renamed whether the actions of other graphs that stand for it get the new
 * name, too.
 */

import { Button, Checkbox, Group, Modal, Stack } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useState } from "react";
import { errorText } from "../api/http";
import { callUses } from "../api/inside";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";

export interface RenamedUse {
  readonly id: string;
  readonly name: string;
}

interface Props {
  /** The id of the graph that was renamed. */
  graph: string;
  before: string;
  name: string;
  /** The graphs with an action of the old name. */
  uses: readonly RenamedUse[];
  onClose: () => void;
}

export function RenamedUses({ graph, before, name, uses, onClose }: Props) {
  const [left, setLeft] = useState<ReadonlySet<string>>(new Set());
  const [changed, setChanged] = useState<readonly string[]>([]);
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  const open = uses.filter(({ id }) => !changed.includes(id));
  const chosen = open.filter(({ id }) => !left.has(id));
  const nameOf = (id: string) => uses.find((use) => use.id === id)?.name || "Untitled";
  const flip = (id: string) => {
    const next = new Set(left);
    if (!next.delete(id)) next.add(id);
    setLeft(next);
  };
  const change = async () => {
    setBusy(true);
    try {
      const graphs = chosen.map(({ id }) => id);
      const done = await callUses(graph, { before, name, graphs });
      notifications.show({ message: `Changed in ${counted(done.changed.length, "graph")}, too.` });
      if (!done.refused?.length) return onClose();
      setChanged([...changed, ...done.changed]);
      setWrong(
        done.refused.map(({ graph, why }) => `${isolated(nameOf(graph))}: ${why}`).join(" "),
      );
      setBusy(false);
    } catch (error) {
      setWrong(errorText(error));
      setBusy(false);
    }
  };
  return (
    <Modal opened onClose={onClose} title="Change its name in other graphs, too?" size="30rem">
      <Stack gap="sm">
        <p>
          <bdi>“{before}”</bdi> is called <bdi>“{name}”</bdi> now. Actions called{" "}
          <bdi>“{before}”</bdi> stand for this graph in {counted(uses.length, "graph")}. If you do
          not rename them, they stand for no graph any more.
        </p>
        {open.map((use) => (
          <Checkbox
            key={use.id}
            label={<bdi>{use.name || "Untitled"}</bdi>}
            checked={!left.has(use.id)}
            onChange={() => flip(use.id)}
          />
        ))}
        {wrong !== "" && <p role="alert">{wrong}</p>}
        <Group justify="flex-end">
          <Button onClick={onClose}>Leave them</Button>
          <Button
            variant="filled"
            data-autofocus
            loading={busy}
            disabled={chosen.length === 0}
            onClick={() => void change()}
          >
            Change in {counted(chosen.length, "graph")}
          </Button>
        </Group>
      </Stack>
    </Modal>
  );
}
