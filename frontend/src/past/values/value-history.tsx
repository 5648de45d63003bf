/** All values of a field: as a line where they are numbers, as a table, with what ran, and the way back. */
import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconArrowBackUp } from "@tabler/icons-react";
import { type CSSProperties, useMemo } from "react";
import { type FieldValue, useFieldValues } from "../../api/documents/history";
import { authorName } from "../../api/graphs";
import { errorText } from "../../api/http";
import { useEditorContext } from "../../edit-actions/editor-context";
import { usePersonColors, useThrottledLink } from "../../sync/use-room";
import { day, hourMinute, instant, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import { useTimeline } from "../told/use-timeline";
import { blamedName } from "./blame-words";
import { canSetBack, setBack } from "./set-back";
import { ValueChart } from "./value-chart";
import { factsOf, runNumbers, spansOf, type ValueSpan } from "./value-spans";
import style from "./values.module.css";

interface ByProps {
  value: Pick<FieldValue, "author" | "at" | "merged">;
  color: string;
}

/** Who set a value, and when; of one that came by a merge, who merged it. */
export function By({ value, color }: ByProps) {
  const now = useNow(60_000);
  const at = instant(value.at);
  return (
    <span className={style.by}>
      <i style={{ "--c": color } as CSSProperties} aria-hidden />
      <bdi>{authorName(value.author)}</bdi>
      {at !== null && ` · ${day(at, now)} ${hourMinute(at)}`}
      {value.merged && (
        <span>
          {" · merged by "}
          <bdi>{authorName(value.merged.by)}</bdi>
        </span>
      )}
    </span>
  );
}

interface TableProps {
  field: string;
  spans: readonly ValueSpan[];
  colorOf: (person: string) => string;
  at: number;
}

/** The newest value first; each leads to its moment. */
function ValueTable({ field, spans, colorOf, at }: TableProps) {
  const { lookAt, past } = useEditorContext();
  const here = spans.findLast(({ value }) => value.seq <= at);
  return (
    <table className={style.table}>
      <caption className="visually-hidden">Values of {isolated(blamedName(field))}</caption>
      <thead className="visually-hidden">
        <tr>
          <th scope="col">Value</th>
          <th scope="col">Set by</th>
          <th scope="col">Runs</th>
        </tr>
      </thead>
      <tbody>
        {[...spans].reverse().map((span) => (
          <tr key={span.value.seq} data-here={span === here || undefined}>
            <td>
              <button
                type="button"
                aria-current={span === here || undefined}
                onClick={() => lookAt({ at: span.value.seq, with: past?.with ?? "own" })}
              >
                <code>{span.text}</code>
                <span className="visually-hidden">: look at that moment</span>
              </button>
            </td>
            <td>
              <By value={span.value} color={colorOf(span.value.author.id)} />
            </td>
            <td className={style.ran}>{runNumbers(span.runs)}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** What it can be set back to: what it was at the moment that is looked at, else the value before. */
function earlierValue(field: string, spans: readonly ValueSpan[], at: number): ValueSpan | null {
  const now = spans.at(-1);
  if (now === undefined) return null;
  const fits = (span: ValueSpan | undefined) =>
    span !== undefined && span.text !== now.text && canSetBack(field, span.value.value);
  const here = spans.findLast(({ value }) => value.seq <= at);
  if (fits(here)) return here ?? null;
  return spans.findLast(fits) ?? null;
}

interface Props {
  of: string;
  field: string;
}

function SetBack({ of, field, span }: Props & { span: ValueSpan }) {
  const { doc, lookAt } = useEditorContext();
  const name = blamedName(field);
  const set = () => {
    const done = setBack(doc, of, field, span.value.value);
    lookAt(null);
    notifications.show(
      done
        ? { message: `${isolated(name)} is ${span.text} again`, autoClose: 4_000 }
        : { color: "red", title: "Not set back", message: "What it belongs to is not there now." },
    );
  };
  return (
    <Button
      fullWidth
      variant="default"
      className={style.back ?? ""}
      leftSection={<IconArrowBackUp size={15} aria-hidden />}
      onClick={set}
    >
      <span className={style.backWords}>
        Set {isolated(name)} back to <code>{span.text}</code>
      </span>
    </Button>
  );
}

export function ValueHistory({ of, field }: Props) {
  const { id, past, mayGoBack } = useEditorContext();
  const { seq } = useThrottledLink();
  const at = past?.at ?? seq;
  const found = useFieldValues(id, of, field, Math.max(seq, at));
  const { versions, runs } = useTimeline(id);
  const colorOf = usePersonColors(found.data?.map(({ author }) => author.id));
  const { data } = found;
  const spans = useMemo(
    () => spansOf(field, data ?? [], versions, runs),
    [field, data, versions, runs],
  );
  if (found.isPending) return <Skeleton height={40} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  const numbers = spans.filter(({ number }) => number !== null).length;
  const earlier = earlierValue(field, spans, at);
  return (
    <div className={style.values}>
      {numbers > 1 && <ValueChart {...{ spans, colorOf, at }} />}
      <ValueTable {...{ field, spans, colorOf, at }} />
      <ul className={style.facts} aria-label={`What ran with each ${isolated(blamedName(field))}`}>
        {factsOf(spans).map(({ text, words }) => (
          <li key={text}>
            <b>
              With <bdi>{text}</bdi>:
            </b>{" "}
            {words}
          </li>
        ))}
      </ul>
      {earlier !== null && mayGoBack && of !== "" && <SetBack {...{ of, field }} span={earlier} />}
    </div>
  );
}
