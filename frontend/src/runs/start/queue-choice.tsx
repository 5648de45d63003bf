/** Offer in the start dialog to wait in the queue, where a robot is busy or others wait for it. */
import { Button } from "@mantine/core";
import { IconHourglassEmpty } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { useLocation } from "wouter";
import { queryKeys, type Version } from "../../api/graphs";
import { errorText } from "../../api/http";
import { useLive } from "../../api/page-link";
import { sendPress } from "../../api/presses";
import { enterQueue, type QueueEntry, useQueue } from "../../api/queue";
import type { Preflight } from "../../api/robots";
import { sendNoted, Unanswered } from "../../status/unanswered-starts";
import { isolated } from "../../words/isolated";
import { pressOf } from "./looked-at";
import style from "./start-dialog.module.css";
import { notifyFailure, type StartInput, useOrder, versionWords } from "./use-start";

/** Items in the way that waiting, or the person at the start itself, may mend. */
const PASSING: ReadonlySet<string> = new Set([
  ...["free", "again", "quiet", "rest", "baton", "confirm", "watched", "present", "approved"],
]);
/** The checks that say that something goes on at the robot. */
const BUSY: ReadonlySet<string> = new Set(["free", "quiet"]);

const blockedIn = (looks: readonly Preflight[] | undefined) =>
  (looks ?? []).flatMap(({ items }) => items).filter(({ verdict }) => verdict === "blocked");

/** Return whether something goes on on a robot of a start, whoever has started it. */
export function isBusy(looks: readonly Preflight[] | undefined): boolean {
  return blockedIn(looks).some(({ code }) => BUSY.has(code));
}

/** Return whether a start was looked at, and nothing is in the way that no waiting mends. */
export function mayWait(looks: readonly Preflight[] | undefined): boolean {
  if (looks === undefined || looks.length === 0) return false;
  return blockedIn(looks).every(({ code, overridable }) => overridable || PASSING.has(code));
}

/** Return the codes that a start overrides which waits: not those that waiting mends. */
export function codesOfWaiting(looks: readonly Preflight[] | undefined): string[] {
  const over = blockedIn(looks).filter((each) => each.overridable && !PASSING.has(each.code));
  return [...new Set(over.flatMap(({ codes }) => codes))];
}

const NAMED = 3;

/** Return words for the starts that wait for one of these robots already; "" for none. */
export function othersWords(entries: readonly QueueEntry[], robots: readonly string[]): string {
  const others = entries.filter((each) => each.robots.some((robot) => robots.includes(robot)));
  if (others.length === 0) return "";
  const there = robots.filter((robot) => others.some((each) => each.robots.includes(robot)));
  const names = others
    .slice(0, NAMED)
    .map((each) => `${isolated(each.graph_name)} (${isolated(each.author.name || "somebody")})`);
  const more = others.length > NAMED ? ` and ${others.length - NAMED} more` : "";
  const wait = others.length === 1 ? "start waits" : "starts wait";
  return `${others.length} ${wait} for ${there.map(isolated).join(", ")}: ${names.join(", ")}${more}. A start now goes before ${others.length === 1 ? "it" : "them"}.`;
}

/** Put exactly what was looked at into the queue, and go to its page. */
function useEnterQueue(graph: string, onSent: () => void) {
  const [, go] = useLocation();
  const ordered = useOrder(graph);
  const client = useQueryClient();
  return useMutation({
    mutationFn: async (wanted: StartInput) => {
      const { watching: _, drill: __, from: ___, ...rest } = wanted;
      // It is put there after a look only.
      const { version, order } = await ordered({ ...rest, digest: wanted.digest ?? "" });
      const versions = client.getQueryData<Version[]>(queryKeys.versions(graph)) ?? [];
      const what = versionWords(versions, version);
      const does = "was put into the queue";
      const hint = "Nothing starts by that. Another press of the same counts once.";
      const sent = { graph, what, engines: order.engines, does, hint };
      return sendPress(pressOf("queue", order), (request) =>
        sendNoted({ ...sent, request }, () => enterQueue({ ...order, request })),
      );
    },
    onSuccess: () => {
      onSent();
      go("/runs/queue");
    },
    onError: (error) => {
      if (error instanceof Unanswered) onSent();
      else notifyFailure("Not put into the queue", errorText(error));
    },
  });
}

interface Props {
  graph: string;
  wanted: StartInput;
  looks: readonly Preflight[] | undefined;
  /** The robots of the start. */
  robots: readonly string[];
  /** The reason why this start cannot wait; null when it can. */
  obstacle: string | null;
  /** The reason of the person to start in spite of checks. */
  reason: string;
  /** The start was sent, whether or not it was answered. */
  onSent: () => void;
}

/** Says who waits for the robots already, and offers to wait too. Nothing while they are free for all. */
export function QueueOffer({ graph, wanted, looks, robots, obstacle, reason, onSent }: Props) {
  const { now } = useLive();
  const queue = useQueue((now.queue?.number ?? 0) > 0).data;
  const enter = useEnterQueue(graph, onSent);
  const others = othersWords(queue?.entries ?? [], robots);
  if (others === "" && !isBusy(looks)) return null;
  const codes = codesOfWaiting(looks);
  const override = codes.length > 0 ? { override: { codes, reason: reason.trim() } } : {};
  const why = obstacle ?? (codes.length > 0 && reason.trim() === "" ? "Say why first" : null);
  return (
    <section className={style.second} aria-label="Wait">
      {others !== "" && <p>{others}</p>}
      {mayWait(looks) && (
        <Button
          size="compact-sm"
          variant="default"
          disabled={why !== null}
          loading={enter.isPending}
          leftSection={<IconHourglassEmpty size={14} aria-hidden />}
          onClick={() => enter.mutate({ ...wanted, ...override })}
        >
          {why ?? "Wait in the queue"}
        </Button>
      )}
      {mayWait(looks) && (
        <span className="quiet-12">
          Nothing starts by itself: at its turn you look, and start it.
        </span>
      )}
    </section>
  );
}
