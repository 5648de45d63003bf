/** A graph or a run as a link shows it, kept up to date; refused in words when the link ends. */
import { useEffect, useState } from "react";
import { editor, runnerAt } from "../api/client";
import { errorText, fetchAnswer, isFinal, Refusal } from "../api/http";
import type { EditorApi } from "../api/schema/editor";
import type { RunnerApi } from "../api/schema/runner";
import { tick } from "../clock/server-clock";

/** The thing that a link shows, as its address names it. */
export interface ViewKey {
  readonly kind: "graph" | "run";
  readonly text: string;
}

/** Return the key in the fragment of an address; null if there is none. */
export function viewKeyIn(fragment: string): ViewKey | null {
  const found = /^#(graph|run)=(view_[A-Za-z0-9_-]+)$/.exec(fragment);
  return found?.[2] === undefined ? null : { kind: found[1] as ViewKey["kind"], text: found[2] };
}

/**
 * `lost`: the moment (a tick) since when the server is not heard; what is shown is from then. Null
 * while it is heard.
 */
export type Shared<T> =
  /** `why`: the reason why the server gave nothing so far; "" while it was asked once. */
  | { readonly at: "loading"; readonly why: string }
  | { readonly at: "refused"; readonly why: string }
  | { readonly at: "shown"; readonly thing: T; readonly lost: number | null };

export type SharedGraph = EditorApi["SharedGraph"];

/** `seen`: when the engine last showed the run, as the runner said; null if it never did. */
export interface SharedRun {
  readonly run: RunnerApi["SharedState"];
  readonly umrf: unknown;
  readonly seen: string | null;
}

const AGAIN = [500, 1_000, 2_000, 5_000]; // ms until the next try
const FOR_EVER = 2_000_000_000; // ms
const LOOK = 5_000; // ms between two questions whether the link of a run that is over has ended
const SILENCE = { run: 4_000, graph: 25_000 }; // ms without a word after which a stream counts as lost

/** Takes the thing as it is now, calls `show` with each newer state, and returns when no more can come. */
type Follow<T> = (
  key: string,
  again: boolean,
  show: (thing: T) => void,
  end: AbortSignal,
) => Promise<void>;

/** Yields the data of the events of a stream. Throws when it does not begin, or says nothing, for so long. */
async function* eventsOf(url: string, viewKey: string, silence: number, end: AbortSignal) {
  const quiet = new AbortController();
  const signal = AbortSignal.any([end, quiet.signal]);
  let timer = setTimeout(() => quiet.abort(), silence);
  const heard = () => {
    clearTimeout(timer);
    timer = setTimeout(() => quiet.abort(), silence);
  };
  let rest = "";
  try {
    const answer = await fetchAnswer(url, { viewKey, signal, timeoutMs: FOR_EVER });
    heard();
    const text = answer.body?.pipeThrough(new TextDecoderStream()).getReader();
    for (;;) {
      const next = await text?.read();
      if (next?.value === undefined) return;
      heard();
      const parts = (rest + next.value).split("\n\n");
      rest = parts.pop() ?? "";
      for (const part of parts) if (part.startsWith("data: ")) yield part.slice("data: ".length);
    }
  } finally {
    clearTimeout(timer);
  }
}

const followGraph: Follow<SharedGraph> = async (viewKey, again, show, signal) => {
  const now = (query: { again: boolean }) =>
    editor.get("/api/view/graph", { query, viewKey, signal });
  show(await now({ again }));
  for await (const _ of eventsOf("/api/view/graph/events", viewKey, SILENCE.graph, signal)) {
    show(await now({ again: true }));
  }
};

const followRun: Follow<SharedRun> = async (viewKey, again, show, signal) => {
  const places = await editor.get("/api/view", { signal });
  const { runner, whole } = await firstWith(
    [places.runner_url, ...(places.more_runners ?? [])],
    async (runner) => ({
      runner,
      whole: await runnerAt(runner).get("/api/view/run", { query: { again }, viewKey, signal }),
    }),
  );
  let shown: SharedRun = { ...whole, seen: null };
  show(shown);
  const url = `${runner}/api/view/run/events`;
  while (whole.run.ended_at !== null && whole.run.recorded) {
    // Of what is over the end of the link is the only news: the stream, which ends at once, refuses it then.
    await pause(LOOK, signal);
    signal.throwIfAborted();
    for await (const _ of eventsOf(url, viewKey, SILENCE.run, signal));
  }
  for await (const text of eventsOf(url, viewKey, SILENCE.run, signal)) {
    const said: RunnerApi["SharedStateMessage"] | RunnerApi["SharedBeat"] = JSON.parse(text);
    shown = said.type === "run" ? { ...shown, run: said.run } : { ...shown, seen: said.seen };
    show(shown);
  }
};

/** Returns what the first place answers that knows the link: others refuse its key. */
async function firstWith<T>(
  places: readonly string[],
  ask: (place: string) => Promise<T>,
): Promise<T> {
  const errors: unknown[] = [];
  for (const place of places) {
    try {
      return await ask(place);
    } catch (error) {
      errors.push(error);
    }
  }
  // A place that does not answer may be the one that has it.
  throw errors.find((error) => !(error instanceof Refusal)) ?? errors[0];
}

/** Waits for so long, or until the page ends. */
function pause(ms: number, end: AbortSignal): Promise<void> {
  return new Promise((done) => {
    const timer = setTimeout(done, ms);
    const stop = () => {
      clearTimeout(timer);
      done();
    };
    end.addEventListener("abort", stop, { once: true });
  });
}

function useShared<T>(key: string, follow: Follow<T>): Shared<T> {
  const [shared, setShared] = useState<Shared<T>>({ at: "loading", why: "" });
  useEffect(() => {
    const stop = new AbortController();
    const { signal } = stop;
    const go = async () => {
      let again = false;
      let heard = tick();
      const lose = (error: unknown) =>
        setShared((before) => {
          if (before.at === "loading") return { at: "loading", why: errorText(error) };
          return before.at === "shown" && before.lost === null
            ? { ...before, lost: heard }
            : before;
        });
      for (let tries = 0; !signal.aborted; ) {
        try {
          const show = (thing: T) => {
            again = true;
            tries = 0;
            heard = tick();
            setShared({ at: "shown", thing, lost: null });
          };
          await follow(key, again, show, signal);
        } catch (error) {
          if (signal.aborted) return;
          if (isFinal(error)) {
            setShared({ at: "refused", why: errorText(error) });
            return;
          }
          lose(error);
        }
        if (signal.aborted) return;
        const wait = AGAIN[Math.min(tries, AGAIN.length - 1)] ?? 0;
        tries += 1;
        await pause(wait, signal);
      }
    };
    void go();
    return () => stop.abort();
  }, [key, follow]);
  return shared;
}

export const useSharedGraph = (key: string): Shared<SharedGraph> => useShared(key, followGraph);
export const useSharedRun = (key: string): Shared<SharedRun> => useShared(key, followRun);
