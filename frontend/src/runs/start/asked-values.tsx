/** The values that a start asks for: proposed, typed, and taken over from whoever asks for a yes. */
import { Button, Text } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { useQuery } from "@tanstack/react-query";
import { type ReactNode, useMemo, useState } from "react";
import { useLive } from "../../api/page-link";
import { usePerson } from "../../api/people";
import { pathRefused } from "../../api/refusal-places";
import {
  type ApprovalWanted,
  type AskedInput,
  fetchAskedInputs,
  fetchWantedApprovals,
  type StartFrom,
  type StartValues,
  useEarlierValues,
} from "../../api/starts";
import {
  type Drafts,
  firstDrafts,
  missingWords,
  placeRefused,
  proposalsFor,
  typedValues,
} from "../../status/start-values";
import { StartValuesForm } from "../../status/start-values-form";
import { valueLines, valuesWords } from "../../status/value-words";
import style from "./start-dialog.module.css";

const TYPING = 400; // ms without a key until robots are looked at
const NOTHING: readonly AskedInput[] = [];
const NO_VALUES: StartValues = {};

/** Query what is known of values before a form is shown. */
function useKnown(graph: string, umrf: string | undefined, from: StartFrom | undefined) {
  const { runner } = useLive();
  const { person } = usePerson();
  const asked = useQuery({
    queryKey: ["asked inputs", runner, umrf, from],
    queryFn: ({ signal }) =>
      fetchAskedInputs(runner ?? "", { graph, umrf: umrf ?? "", from }, signal),
    enabled: runner !== undefined && umrf !== undefined,
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 0,
  });
  const asks = (asked.data?.length ?? 0) > 0;
  const earlier = useEarlierValues(graph, asks);
  const wanted = useQuery({
    queryKey: ["approvals", "asked", graph],
    queryFn: ({ signal }) => fetchWantedApprovals(runner ?? "", graph, signal),
    enabled: asks,
    staleTime: 0,
    gcTime: 0,
  });
  const others = (wanted.data ?? []).filter(({ author }) => author.id !== person.id);
  return {
    error: asked.error,
    asked: asks && (earlier.isPending || wanted.isPending) ? undefined : asked.data,
    earlier: earlier.data ?? null,
    wanted: others.find(({ values }) => Object.keys(values).length > 0) ?? null,
  };
}

/** Return why a start has to wait for values; null if it does not. */
function obstacleOf(
  asked: readonly AskedInput[] | undefined,
  drafts: Drafts,
  wrong: ReadonlyMap<string, string>,
  isTyping: boolean,
): string | null {
  if (asked === undefined) return "Looking …";
  return missingWords(asked, drafts, wrong) ?? (isTyping ? "Looking …" : null);
}

export interface AskedValues {
  /** A value is missing or wrong, so nothing can be looked at. */
  readonly isIncomplete: boolean;
  /** The values that are looked at and sent; null until all are given. */
  readonly values: StartValues | null;
  /** The inputs for which the start asks. */
  readonly asked: readonly AskedInput[];
  readonly obstacle: string | null;
  readonly error: Error | null;
  /** The question that the values answer unchanged. */
  readonly taken: ApprovalWanted | null;
  /** Show the form; nothing if the start asks for nothing. `refusal`: of the look. */
  form(refusal: Error | null): ReactNode;
}

/**
 * Keeps the values that a person gives at a start. `before`: values to begin with; `onChange`: they have changed. An
 * edit is looked at once the person pauses, and only what was looked at is sent.
 */
export function useAskedValues(
  graph: string,
  umrf: string | undefined,
  before: StartValues | undefined,
  onChange: () => void,
  from?: StartFrom,
): AskedValues {
  const known = useKnown(graph, umrf, from);
  const { earlier, wanted } = known;
  const asked = known.asked ?? NOTHING;
  const [edited, edit] = useState<Drafts>({});
  const [taken, take] = useState<ApprovalWanted | null>(null);
  const drafts = useMemo(
    () =>
      taken
        ? firstDrafts(asked, taken.values)
        : { ...firstDrafts(asked, before, earlier?.values), ...edited },
    [asked, taken, before, earlier, edited],
  );
  const typed = useMemo(() => typedValues(asked, drafts), [asked, drafts]);
  const text = JSON.stringify(typed.values);
  const [settled] = useDebouncedValue(text, TYPING);
  const isSettled = settled === text;
  const whole = known.asked !== undefined && typed.wrong.size === 0 && isSettled;
  // biome-ignore lint/correctness/useExhaustiveDependencies: the text says the same
  const values = useMemo(() => (whole ? typed.values : null), [whole, text]);
  const takeOver = (question: ApprovalWanted | null) => {
    onChange();
    if (question === null) edit(drafts);
    take(question);
  };
  const form = (refusal: Error | null) => {
    if (asked.length === 0) return null;
    const place = refusal && placeRefused(pathRefused(refusal));
    const wrong = new Map(typed.wrong);
    if (refusal && place !== null && !wrong.has(place)) wrong.set(place, refusal.message);
    return (
      <section className={style.values} aria-label="Values">
        <h3>Values</h3>
        {wanted && (
          <Wanted question={wanted} isTaken={taken?.digest === wanted.digest} onTake={takeOver} />
        )}
        <StartValuesForm
          asked={asked}
          drafts={drafts}
          wrong={wrong}
          readOnly={taken !== null}
          proposals={(each) => proposalsFor(each, before, earlier)}
          onChange={(at, draft) => {
            onChange();
            edit((now) => ({ ...now, [at]: draft }));
          }}
        />
      </section>
    );
  };
  const obstacle = obstacleOf(known.asked, drafts, typed.wrong, !isSettled);
  const isIncomplete = typed.wrong.size > 0;
  return { values, asked, isIncomplete, obstacle, error: known.error, taken, form };
}

interface WantedProps {
  question: ApprovalWanted;
  isTaken: boolean;
  onTake: (question: ApprovalWanted | null) => void;
}

/** Offers the values of a start for which somebody asks others. */
function Wanted({ question, isTaken, onTake }: WantedProps) {
  const asker = <bdi>{question.author.name || "Somebody"}</bdi>;
  return (
    <div className={style.second}>
      <Text size="sm">
        {isTaken ? (
          <>These are the values for which {asker} asks.</>
        ) : (
          <>
            {asker} asks others for their yes, with {valuesWords(question.values)}.
          </>
        )}
      </Text>
      <Button
        size="compact-sm"
        variant={isTaken ? "default" : "filled"}
        onClick={() => onTake(isTaken ? null : question)}
      >
        {isTaken ? "Change them" : "Take these values"}
      </Button>
    </div>
  );
}

/** Lists the values of a start as they will be sent. */
export function ValueList({ values }: { values: StartValues | null }) {
  const lines = valueLines(values ?? NO_VALUES);
  if (lines.length === 0) return null;
  return (
    <>
      <dt className="ink2">With</dt>
      <dd>
        {lines.map((line) => (
          <div key={line.place}>
            <bdi>{line.action}</bdi> <bdi>{line.input}</bdi> = <bdi>{line.text}</bdi>
          </div>
        ))}
      </dd>
    </>
  );
}
