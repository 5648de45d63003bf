/** Choice in the start dialog of how often a start is carried out, and with which values. */
import { Checkbox, Text, Textarea, TextInput } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { useLocation } from "wouter";
import { type Axis, openRepeat, type RepeatOrder } from "../../api/repeats";
import type { AskedInput, StartValues } from "../../api/starts";
import { spokenName } from "../../graph/spoken-name";
import { givenBy } from "../../status/start-values";
import { inputWords, placeOfInput } from "../../status/value-words";
import { useKeptText } from "../../ui/kept-texts";
import { counted } from "../../words/counted";
import { isolated } from "../../words/isolated";
import { notifyPressFailure, sendLookedAt } from "./looked-at";
import style from "./start-dialog.module.css";
import { type StartInput, useOrder } from "./use-start";

const MOST = 500; // runs of one repeat

/** Return the values in a text, one a line, and what is wrong with the first line that is none. */
export function linesGiven(
  asked: AskedInput,
  text: string,
): { values: Axis["values"]; wrong: string } {
  const values: Axis["values"] = [];
  for (const line of text.split("\n").filter((each) => each.trim() !== "")) {
    const given = givenBy(asked, line.trim());
    if (given.kind === "wrong") return { values, wrong: `${isolated(line.trim())}: ${given.why}` };
    if (given.kind === "value") values.push(given.value);
  }
  return { values, wrong: "" };
}

/** Return the values of a start without those of the inputs that a grid gives in turn. */
export function withoutGrid(values: StartValues, grid: readonly Axis[]): StartValues {
  const left = Object.entries(values).map(([action, given]) => {
    const kept = Object.entries(given).filter(
      ([name]) => !grid.some((axis) => axis.action === action && axis.name === name),
    );
    return [action, Object.fromEntries(kept)] as const;
  });
  return Object.fromEntries(left.filter(([, given]) => Object.keys(given).length > 0));
}

interface Choice {
  /** Null if the start is carried out once. */
  readonly order: RepeatOrder | null;
  readonly count: number;
  readonly obstacle: string | null;
  readonly part: ReactNode;
  /** Forget what was typed: the repeat has it. */
  readonly forget: () => void;
}

/**
 * Keeps how often, and with which values, a start is repeated. `moves`: a robot may move, so that a person starts each
 * run; `place`: where typed values are kept.
 */
export function useRepeatChoice(
  asked: readonly AskedInput[],
  moves: boolean,
  place: string,
): Choice {
  const [on, setOn] = useState(false);
  const [times, setTimes] = useState("3");
  const [kept, keep] = useKeptText(place);
  const texts: Readonly<Record<string, string>> = kept === "" ? {} : JSON.parse(kept);
  const [seed, setSeed] = useState<number | null>(null);
  const lines = asked.map((each) => ({
    asked: each,
    at: placeOfInput(each),
    ...linesGiven(each, texts[placeOfInput(each)] ?? ""),
  }));
  const grid = lines
    .filter(({ values }) => values.length > 0)
    .map(({ asked: { action, name }, values }) => ({ action, name, values }));
  const rounds = /^\d{1,6}$/.test(times.trim()) ? Number(times) : 0;
  const count = grid.reduce((all, { values }) => all * values.length, rounds);
  const wrong = lines.find((each) => each.wrong !== "");
  const obstacle = !on
    ? null
    : wrong
      ? `Correct ${isolated(inputWords(wrong.asked.name))}`
      : count < 1
        ? "Say how often"
        : count > MOST
          ? `${MOST} runs at most`
          : null;
  const shuffle = grid.length > 0;
  const order = on ? { times: rounds, grid, seed: shuffle ? seed : null, by_itself: !moves } : null;
  const part = (
    <section className={style.values} aria-label="Repeat">
      <Checkbox
        checked={on}
        onChange={(event) => setOn(event.currentTarget.checked)}
        label="Repeat it"
      />
      {on && (
        <>
          <TextInput
            label={shuffle ? "Rounds" : "Times"}
            value={times}
            inputMode="numeric"
            onChange={(event) => setTimes(event.currentTarget.value)}
          />
          {lines.map(({ asked: each, at, wrong: why }) => (
            <Textarea
              key={at}
              label={`Values of ${isolated(inputWords(each.name))} of ${isolated(spokenName(each.action))}`}
              description="Write one value on each line: there is a run for each value. If you write none, every run takes the value given above."
              value={texts[at] ?? ""}
              error={why || undefined}
              autosize
              minRows={1}
              maxRows={6}
              onChange={(event) => {
                const { value } = event.currentTarget;
                keep(JSON.stringify({ ...texts, [at]: value }));
              }}
            />
          ))}
          {shuffle && (
            <Checkbox
              checked={seed !== null}
              onChange={(event) =>
                setSeed(event.currentTarget.checked ? Math.floor(Math.random() * 1e6) : null)
              }
              label={
                seed === null ? "Shuffle each round" : `Shuffle each round, by the seed ${seed}`
              }
            />
          )}
          <Text size="sm" className="ink2">
            {moves
              ? `${counted(count, "run")}. Nothing starts by itself: before each one you set everything back, look, and hold Reset done.`
              : `${counted(count, "run")}, one after the other, in the simulator.`}
          </Text>
        </>
      )}
    </section>
  );
  return { order, count, obstacle, part, forget: () => keep("") };
}

/** Open a repeat of exactly what was looked at, and go to its page. */
export function useOpenRepeat(graph: string) {
  const [, go] = useLocation();
  const ordered = useOrder(graph);
  return useMutation({
    mutationFn: async ({ repeat, ...wanted }: StartInput & { repeat: RepeatOrder }) => {
      const { watching: _, from: __, values = {}, ...rest } = wanted;
      // A repeat is opened after a look only.
      const looked = { ...rest, digest: wanted.digest ?? "" };
      const { order } = await ordered({ ...looked, values: withoutGrid(values, repeat.grid) });
      const what = `repeat ${JSON.stringify(repeat)}`;
      return sendLookedAt(what, order, (each) => openRepeat(each, repeat));
    },
    onSuccess: ({ id }) => go(`/runs/repeats/${id}`),
    onError: (error) => notifyPressFailure(error, "Not opened", "the repeat was opened"),
  });
}
