/** Offer in the start dialog to wait in the queue, where another run keeps a robot. */
import { Button } from "@mantine/core";
import { IconHourglassEmpty } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useLocation } from "wouter";
import { enterQueue } from "../../api/queue";
import type { Preflight } from "../../api/robots";
import style from "./start-dialog.module.css";
import { notifyPressFailure, type StartInput, sendLookedAt, useOrder } from "./use-start";

/** Items in the way that waiting, or the person at the start itself, may mend. */
const PASSING: ReadonlySet<string> = new Set([
  ...["free", "again", "quiet", "rest", "baton", "confirm", "watched", "present", "approved"],
]);

/** Return whether a robot is not free, and nothing is in the way that no waiting mends. */
export function mayWait(looks: readonly Preflight[] | undefined): boolean {
  const blocked = (looks ?? [])
    .flatMap(({ items }) => items)
    .filter(({ verdict, overridable }) => verdict === "blocked" && !overridable);
  return (
    blocked.some(({ code }) => code === "free") && blocked.every((each) => PASSING.has(each.code))
  );
}

/** Put exactly what was looked at into the queue, and go to its page. */
function useEnterQueue(graph: string) {
  const [, go] = useLocation();
  const ordered = useOrder(graph);
  return useMutation({
    mutationFn: async (wanted: StartInput) => {
      const { watching: _, drill: __, from: ___, ...rest } = wanted;
      // It is put there after a look only.
      const { order } = await ordered({ ...rest, digest: wanted.digest ?? "" });
      return sendLookedAt("queue", order, enterQueue);
    },
    onSuccess: () => go("/runs/queue"),
    onError: (error) =>
      notifyPressFailure(error, "Not put into the queue", "it was put into the queue"),
  });
}

interface Props {
  graph: string;
  wanted: StartInput;
  onEntered: () => void;
}

export function QueueButton({ graph, wanted, onEntered }: Props) {
  const enter = useEnterQueue(graph);
  return (
    <section className={style.second} aria-label="Wait">
      <Button
        size="compact-sm"
        variant="default"
        loading={enter.isPending}
        leftSection={<IconHourglassEmpty size={14} aria-hidden />}
        onClick={() => enter.mutate(wanted, { onSuccess: onEntered })}
      >
        Wait in the queue
      </Button>{" "}
      <span className="quiet-12">
        Nothing starts by itself: at its turn you look, and start it.
      </span>
    </section>
  );
}
