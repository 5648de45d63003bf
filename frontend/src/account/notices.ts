/**
 * Facts of which a page that is not looked at notifies by the browser: the sentences are those of
 * messages by mail (`web/notifications/messages.py`).
 */
import type { LiveState } from "../api/live-socket";
import { type Inbox, mentionPath } from "../api/mentions";
import { isolated } from "../words/isolated";

export interface Notice {
  /** Equal keys tell of one fact. */
  readonly key: string;
  readonly text: string;
  /** The place on the page. */
  readonly path: string;
  /** The mention that it tells of. */
  readonly mention?: string;
}

const FAILED: Readonly<Record<string, string>> = {
  error: "an error",
  refused: "refused by the engine",
  lost: "nothing proves its end",
  halted: "nothing was left to run",
};
const LOST: Readonly<Record<string, string>> = {
  gone: "does not answer any more",
  restarted: "has a new engine process",
};

type Live = Pick<LiveState, "runs" | "engines" | "queue">;

/** Return all facts that hold now, of runs on robots and of unread mentions. */
export function noticesOf({ runs, engines, queue }: Live, inbox: Inbox | undefined): Notice[] {
  const found: Notice[] = [];
  for (const run of runs.values()) {
    if (run.simulated) continue;
    const robots = run.robots ? [...new Set(Object.values(run.robots))] : [run.engine];
    const names = robots.map(isolated).join(", ");
    const words = `un ${run.number} of ${isolated(run.graph_name)} on ${names}`;
    const path = `/runs/${run.id}`;
    const end = FAILED[run.state] ?? (run.result === "on_error" ? "an error" : "");
    if (run.ended_at !== null && end !== "") {
      const text = `R${words} has failed: ${end}. ${isolated(run.detail)}`.trim();
      found.push({ key: `run.ended:${run.id}`, text, path });
    }
    const alarm = run.alarms.find(({ code }) => code === "stop_unconfirmed");
    if (alarm !== undefined && run.ended_at === null) {
      const text = `The Stop of r${words} is unconfirmed: ${names} may still be moving. ${isolated(alarm.text)}`;
      found.push({ key: `run.stop_unconfirmed:${run.id}`, text, path });
    }
    const held = run.held && (run.held.by === null || run.held.how === "trouble");
    if (run.held && held && run.ended_at === null) {
      const text = `R${words} waits for a person, who lets it go on or stops it. ${isolated(run.held.why)}`;
      found.push({ key: `run.held:${run.id}:${run.held.since}`, text, path });
    }
    for (const { action, visit, text: asked } of run.ended_at === null
      ? (run.questions ?? [])
      : []) {
      const text = `R${words} waits for the answer of a person. ${isolated(asked)}`;
      found.push({ key: `answer.asked:${run.id}:${action}:${visit}`, text, path });
    }
    for (const robot of run.ended_at === null ? robots : []) {
      const how = LOST[engines.find(({ name }) => name === robot)?.state ?? ""];
      if (how === undefined) continue;
      const rest = `run ${run.number} of ${isolated(run.graph_name)} is not over.`;
      const text = `${isolated(robot)} ${how}, and ${rest}`;
      found.push({ key: `robot.lost:${robot}:${run.id}`, text, path });
    }
  }
  if (queue && queue.yours > 0) {
    const text = "It is the turn of a start that you have put into the queue.";
    found.push({ key: `queue.ready:${queue.ready_at}`, text, path: "/runs/queue" });
  }
  for (const mention of inbox?.mentions ?? []) {
    if (mention.is_read) continue;
    const { author, graph_name } = mention;
    const place = `in a comment on ${isolated(graph_name)}`;
    const text = `${isolated(author.name || "Somebody")} has mentioned you ${place}.`;
    const path = mentionPath(mention);
    found.push({ key: `mention:${mention.key}`, text, path, mention: mention.key });
  }
  return found;
}

/** Finds new facts: those that hold when it is made, and those that were found before, are none. */
export class NewNotices {
  readonly #known: Set<string>;

  constructor(known: readonly Notice[]) {
    this.#known = new Set(known.map(({ key }) => key));
  }

  /** Return the facts that were not there before; each is returned once. */
  take(now: readonly Notice[]): Notice[] {
    const fresh = now.filter(({ key }) => !this.#known.has(key));
    for (const { key } of fresh) this.#known.add(key);
    return fresh;
  }
}
