/**
 * Starts that got no answer: their outcome is unknown until the runner tells it, and they are never
 * sent again.
 */
import { CloseButton, Loader } from "@mantine/core";
import { useQuery } from "@tanstack/react-query";
import { useEffect } from "react";
import { Link } from "wouter";
import { errorText, isOutcomeUnknown } from "../api/http";
import { CONDUCTED, engineWords } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { SIMULATOR } from "../api/robots";
import { findStart, type Run, type StartFound } from "../api/runs";
import { serverNow } from "../clock/server-clock";
import { colorOfName } from "../ui/name-colors";
import { useWatched, Watched } from "../ui/watched";
import { isolated } from "../words/isolated";
import { useRunStatus } from "./progress";
import style from "./unanswered-starts.module.css";

const AGAIN = 2_000; // ms between two looks
const PATIENCE = 5_000; // ms that one look waits

/** The engines of a start that the runner has no run for; none once it is known to be in the queue. */
export function missing(sent: SentStart, found: StartFound | undefined): readonly string[] {
  if (found?.queued) return [];
  const there = new Set((found?.runs ?? []).map((run) => run.engine));
  return sent.engines.filter((engine) => !there.has(engine));
}

/** Return words for starts whose outcome is unknown. */
export function unknownWords(
  sent: SentStart,
  found: StartFound | undefined,
  silent: boolean,
): string | null {
  const left = missing(sent, found);
  if (left.length === 0) return null;
  const where = left.map((engine) =>
    engine === SIMULATOR ? "the simulator" : engine === CONDUCTED ? "its robots" : engine,
  );
  const does = sent.does ?? `started on ${where.map(isolated).join(", ")}`;
  const head = `NOT KNOWN whether ${sent.what} ${does}.`;
  const after = `The page looks for this start, and does not send it again. ${sent.hint ?? "Stop works."}`;
  if (silent || found === undefined) return `${head} The runner has not answered. ${after}`;
  if (found.under_way) return `${head} The runner is still carrying it out. ${after}`;
  return `${head} The runner knows nothing of this start so far. ${after}`;
}

function Found({ run }: { run: Run }) {
  const { word } = useRunStatus(run);
  return (
    <p className={style.found}>
      <i style={{ background: colorOfName(run.engine) }} aria-hidden />
      <span>
        Started after all: <Link to={`/runs/${run.id}`}>run {run.number}</Link> on{" "}
        {run.simulated ? "the simulator" : engineWords(run)}, {word}.
      </span>
    </p>
  );
}

function Start({ sent }: { sent: SentStart }) {
  const { live, runner, now } = useLive();
  const look = useQuery({
    queryKey: ["starts", sent.request],
    queryFn: ({ signal }) => findStart(runner ?? "", sent.request, PATIENCE, signal),
    enabled: runner !== undefined,
    refetchInterval: ({ state }) => (missing(sent, state.data).length > 0 ? AGAIN : false),
    retry: false,
    staleTime: 0,
  });
  const found = look.data;
  useEffect(() => {
    for (const run of found?.runs ?? []) live?.learn(run);
  }, [found, live]);
  const runs = (found?.runs ?? []).map((run) => now.runs.get(run.id) ?? run);
  const unknown = unknownWords(sent, found, look.isError || now.link === "down");
  const told = unknown === null || (found !== undefined && !found.under_way && !look.isError);
  return (
    <div className={style.start} data-unknown={unknown !== null || undefined}>
      <div>
        {unknown !== null && <p role="alert">{unknown}</p>}
        {found?.queued && runs.length === 0 && (
          <p className={style.found}>
            <span>
              {sent.what} was put into <Link to="/runs/queue">the queue</Link> after all.
            </span>
          </p>
        )}
        {runs.map((run) => (
          <Found key={run.id} run={run} />
        ))}
      </div>
      {told ? (
        <CloseButton
          size="sm"
          aria-label="Hide"
          onClick={() => unansweredStarts.settle(sent.request)}
        />
      ) : (
        <Loader size="xs" color="currentColor" aria-label="Looking" />
      )}
    </div>
  );
}

export function UnansweredStartNotice() {
  const starts = useWatched(unansweredStarts);
  if (starts.length === 0) return null;
  return (
    <section className={style.notice} aria-label="Starts without an answer">
      {starts.map((sent) => (
        <Start key={sent.request} sent={sent} />
      ))}
    </section>
  );
}

export interface SentStart {
  /** Its `request_id`: by this the runner knows what it has become. */
  request: string;
  graph: string;
  /** The graph that was sent, in words: "v3 of patrol". */
  what: string;
  engines: readonly string[];
  /** The effect of its arrival, and the hint until that is seen, if it is sent to wait and not to start. */
  does?: string;
  hint?: string;
  /** Time at which it was sent, ms. */
  at: number;
}

const KEY = "aa.starts";
const MOST = 20;

type Storing = Pick<Storage, "getItem" | "setItem">;

/** Lives as long as the tab: whoever leaves a graph is still told what became of its start. */
export class UnansweredStarts {
  readonly #storage: Storing | null;
  #sent: readonly SentStart[];
  /** Requests whose answer this page still waits for. */
  readonly #awaited = new Set<string>();
  readonly #unsure: Watched<readonly SentStart[]>;

  /** Starts in the storage were sent by an earlier page, which can no longer get their answers. */
  constructor(storage: Storing | null) {
    this.#storage = storage;
    this.#sent = stored(storage);
    this.#unsure = new Watched(this.#sent);
  }

  subscribe = (listener: () => void): (() => void) => this.#unsure.subscribe(listener);

  /** Return the starts that no answer will come for. */
  now = (): readonly SentStart[] => this.#unsure.now();

  /**
   * Note a start right before it is sent: from then on its outcome is unknown until an answer
   * comes.
   */
  sends(start: SentStart): void {
    this.#awaited.add(start.request);
    const others = this.#sent.filter(({ request }) => request !== start.request);
    this.#put([...others, start].slice(-MOST));
  }

  /** There will be no answer. */
  doubt(request: string): void {
    this.#awaited.delete(request);
    this.#put(this.#sent);
  }

  /** Forget a start that was answered, or whose outcome a person has seen. */
  settle(request: string): void {
    this.#awaited.delete(request);
    this.#put(this.#sent.filter((each) => each.request !== request));
  }

  #put(sent: readonly SentStart[]): void {
    this.#sent = sent;
    try {
      this.#storage?.setItem(KEY, JSON.stringify(sent));
    } catch {
      // A tab that stores nothing still knows it until it is loaded anew.
    }
    this.#unsure.set(sent.filter(({ request }) => !this.#awaited.has(request)));
  }
}

function stored(storage: Storing | null): readonly SentStart[] {
  try {
    const found: unknown = JSON.parse(storage?.getItem(KEY) ?? "[]");
    return Array.isArray(found) ? found.filter(isSent) : [];
  } catch {
    return [];
  }
}

function isSent(value: unknown): value is SentStart {
  if (typeof value !== "object" || value === null) return false;
  const { request, what, engines } = value as Partial<SentStart>;
  return typeof request === "string" && typeof what === "string" && Array.isArray(engines);
}

function storage(): Storing | null {
  try {
    return window.sessionStorage;
  } catch {
    return null; // a browser may forbid it
  }
}

export const unansweredStarts = new UnansweredStarts(storage());

/** The error of a start that nobody has answered: the notice of such starts says it. */
export class Unanswered extends Error {}

/**
 * Send a start, or one for the queue. Where nobody says what became of it, the page looks for it from then on,
 * and the promise rejects with `Unanswered`. Another press that is refused settles no earlier one in doubt.
 */
export async function sendNoted<T>(
  start: Omit<SentStart, "at">,
  send: () => Promise<T>,
): Promise<T> {
  const { request } = start;
  const wasInDoubt = unansweredStarts.now().some((each) => each.request === request);
  unansweredStarts.sends({ ...start, at: serverNow() });
  try {
    const answer = await send();
    unansweredStarts.settle(request);
    return answer;
  } catch (error) {
    if (isOutcomeUnknown(error)) {
      unansweredStarts.doubt(request);
      throw new Unanswered(errorText(error));
    }
    if (wasInDoubt) unansweredStarts.doubt(request);
    else unansweredStarts.settle(request);
    throw error;
  }
}
