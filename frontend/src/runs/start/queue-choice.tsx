/** Offer in the start dialog to wait in the queue, where another run keeps a robot. */
import { Button } from "@mantine/core";
import { IconHourglassEmpty } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useLocation } from "wouter";
import { queryKeys } from "../../api/graphs";
import { errorText } from "../../api/http";
import { insideOf } from "../../api/inside";
import { useLive } from "../../api/page-link";
import { enterQueue } from "../../api/queue";
import type { Preflight } from "../../api/robots";
import { newAid } from "../../graph/document-keys";
import style from "./start-dialog.module.css";
import { checkedVersion, notifyFailure, type StartInput } from "./use-start";

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
  const { runner } = useLive();
  const client = useQueryClient();
  const [, go] = useLocation();
  return useMutation({
    mutationFn: async (wanted: StartInput) => {
      const { seq, digest, tree, led, watching: _, drill: __, from: ___, ...rest } = wanted;
      if (runner === undefined) throw new Error("The address of the runner is not known yet.");
      // It is put there after a look only.
      const { version, umrf } = await checkedVersion(graph, await seq, digest ?? "", tree);
      void client.invalidateQueries({ queryKey: queryKeys.versions(graph) });
      return enterQueue({
        ...rest,
        runner,
        version: version.id,
        digest: version.digest,
        umrf,
        inside: insideOf(version),
        graph,
        request: newAid(),
        ...(led === undefined ? {} : { led }),
      });
    },
    onSuccess: () => go("/runs/queue"),
    onError: (error) => notifyFailure("Not put into the queue", errorText(error)),
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
