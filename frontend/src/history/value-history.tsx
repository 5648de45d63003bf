/** All values of a field: as a line where they are numbers, as a table, with what ran, and the way back. */
import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconArrowBackUp } from "@tabler/icons-react";
import { type CSSProperties, useMemo } from "react";
import type * as Y from "yjs";
import { authorName } from "../api/graphs";
import { type FieldValue, useFieldValues } from "../api/history";
import { errorText } from "../api/http";
import { useEditorContext } from "../edit-actions/editor-context";
import { addParameter, setField, setParameter, setRequired, setResponse } from "../graph/edit";
import { plainFieldWords } from "../graph/field-words";
import { memberText } from "../graph/json-members";
import { PRECONDITIONS, RESPONSES } from "../graph/model";
import { withValue } from "../graph/parameters/values";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import { day, hourMinute, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import { useTimeline } from "./timeline";
import style from "./value-history.module.css";
import {
  factsOf,
  type OverwrittenValue,
  overwrittenOf,
  runNumbers,
  spansOf,
  type ValueSpan,
} from "./value-spans";

interface ByProps {
  value: Pick<FieldValue, "author" | "at" | "merged">;
  color: string;
}

/** Names who set a value and when; for a value from a merge also who merged it. */
export function By({ value, color }: ByProps) {
  const now = useNow(60_000);
  const at = instant(value.at);
  return (
    <span className={style.by}>
      <i style={{ "--c": color } as CSSProperties} aria-hidden />
      <bdi className="ellipsis ink weight-600">{authorName(value.author)}</bdi>
      {at !== null && ` · ${day(at, now)} ${hourMinute(at)}`}
      {value.merged && (
        <span>
          {" · merged by "}
          <bdi className="ellipsis ink weight-600">{authorName(value.merged.by)}</bdi>
        </span>
      )}
    </span>
  );
}

interface TableProps {
  field: string;
  spans: readonly ValueSpan[];
  overwritten: readonly OverwrittenValue[];
  colorOf: (person: string) => string;
  at: number;
}

/** A value that was overwritten at once: it leads nowhere, since the field never showed it. */
function OverwrittenRow({ lost, color }: { lost: OverwrittenValue; color: string }) {
  return (
    <tr>
      <td>
        <code>{lost.text}</code>
      </td>
      <td>
        <By value={lost.value} color={color} />
      </td>
      <td className={style.lost}>
        overwritten at once by <code>{lost.stayed}</code>
      </td>
    </tr>
  );
}

/** The newest value first; each that the field has shown leads to its moment. */
function ValueTable({ field, spans, overwritten, colorOf, at }: TableProps) {
  const { lookAt, past } = useEditorContext();
  const here = spans.findLast(({ value }) => value.seq <= at);
  const rows = [...spans, ...overwritten].sort((a, b) => b.value.seq - a.value.seq);
  return (
    <table className={style.table}>
      <caption className="visually-hidden">Values of {isolated(plainFieldWords(field))}</caption>
      <thead className="visually-hidden">
        <tr>
          <th scope="col">Value</th>
          <th scope="col">Set by</th>
          <th scope="col">Runs</th>
        </tr>
      </thead>
      <tbody>
        {rows.map((span) =>
          "stayed" in span ? (
            <OverwrittenRow
              key={`lost ${span.value.seq}`}
              lost={span}
              color={colorOf(span.value.author.id)}
            />
          ) : (
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
          ),
        )}
      </tbody>
    </table>
  );
}

/**
 * Return the value that a field can be set back to: that of the moment on screen, else the one
 * before.
 */
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
  const name = plainFieldWords(field);
  const set = () => {
    const done = setBack(doc, of, field, span.value.value);
    lookAt(null);
    notifications.show(
      done
        ? { message: `${isolated(name)} is ${span.text} again`, autoClose: 4_000 }
        : {
            color: "red",
            title: "Not set back",
            message: "The part of the graph with this value no longer exists.",
          },
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
      <span className="ellipsis">
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
      <ValueTable
        {...{ field, spans, colorOf, at }}
        overwritten={overwrittenOf(field, data ?? [])}
      />
      <ul
        className={style.facts}
        aria-label={`Runs with each value of ${isolated(plainFieldWords(field))}`}
      >
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

const [WIDTH, HEIGHT] = [264, 104];
const AREA = { left: 34, right: 12, top: 18, bottom: 22 };
const MOST = 8; // steps: of more the last ones

const shortNumber = (value: number): string =>
  Math.abs(value) >= 1e5 || (value !== 0 && Math.abs(value) < 1e-3)
    ? value.toExponential(1)
    : `${Number(value.toPrecision(4))}`;

/** From 0, or from the least where that is far from it. */
function boundsOf(numbers: readonly number[]): [least: number, most: number] {
  const [least, most] = [Math.min(...numbers), Math.max(...numbers)];
  const near = least >= 0 && least < (most - least) * 4 ? 0 : least;
  return most > near ? [near, most] : [near, near + 1];
}

interface ValueChartProps {
  spans: readonly ValueSpan[];
  colorOf: (person: string) => string;
  /** The moment that is looked at. */
  at: number;
}

function ValueChart({ spans: all, colorOf, at }: ValueChartProps) {
  const spans = all.slice(-MOST).filter(({ number }) => number !== null);
  const [least, most] = boundsOf(spans.map(({ number }) => number ?? 0));
  const step = (WIDTH - AREA.left - AREA.right) / spans.length;
  const x = (i: number) => AREA.left + i * step;
  const y = (number: number) =>
    HEIGHT - AREA.bottom - ((number - least) / (most - least)) * (HEIGHT - AREA.top - AREA.bottom);
  const steps = spans.map((span, i) => ({ span, i, x: x(i), y: y(span.number ?? 0) }));
  const line = steps.map(({ i, x, y }) => `${i === 0 ? "M" : "L"}${x} ${y}H${x + step}`).join("");
  const here = steps.findLast(({ span }) => span.value.seq <= at);
  const isRoomy = step >= 48;
  return (
    <svg className={style.chart} viewBox={`0 0 ${WIDTH} ${HEIGHT}`} aria-hidden>
      {[least, most].map((bound) => (
        <g key={bound}>
          <path className={style.grid} d={`M${AREA.left} ${y(bound)}H${WIDTH - AREA.right}`} />
          <text className={style.tick} x={AREA.left - 6} y={y(bound) + 3.5} textAnchor="end">
            {shortNumber(bound)}
          </text>
        </g>
      ))}
      {here && <rect className={style.here} x={here.x} y={6} width={step} height={HEIGHT - 24} />}
      <path className={style.line} d={line} />
      {steps.map(({ span, x, y }) => (
        <g key={span.value.seq}>
          <circle cx={x} cy={y} r={4} style={{ stroke: colorOf(span.value.author.id) }} />
          {isRoomy && (
            <text className={style.said} x={x + 7} y={y - 6}>
              <tspan>{shortNumber(span.number ?? 0)}</tspan>{" "}
              {authorName(span.value.author).slice(0, 8)}
            </text>
          )}
          <text className={style.tick} x={x} y={HEIGHT - 6}>
            {isRoomy ? runNumbers(span.runs) : ""}
          </text>
        </g>
      ))}
    </svg>
  );
}

const FIELDS = ["type", "actor", "description"] as const;

/** Return whether a field can be set back alone: a value, a text, or a response to an outcome. */
export function canSetBack(field: string, value: unknown): boolean {
  if (value === null || value === undefined) return false;
  return /^in\/|^(type|actor|description|required|on_(true|false|error|stopped))$/.test(field);
}

/** The value alone, where what stands around it was not changed in kind since. */
function asIt(now: string, then: string): string {
  const [type, value] = [memberText(then, "pvf_type"), memberText(then, "pvf_value")];
  return type !== null && type === memberText(now, "pvf_type") ? withValue(now, value) : then;
}

function setInput(doc: Y.Doc, key: string, path: string, then: string): boolean {
  return (
    setParameter(doc, key, "in", path, (now) => asIt(now, then)) ||
    addParameter(doc, key, "in", path, then)
  );
}

/** Set a field back to an earlier value. Return false if the thing that it belongs to is gone. */
export function setBack(doc: Y.Doc, of: string, field: string, value: unknown): boolean {
  if (field === "required") return setRequired(doc, of, value !== false);
  if (typeof value !== "string") return false;
  if (field.startsWith("in/")) return setInput(doc, of, field.slice(3), value);
  const own = FIELDS.find((each) => each === field);
  if (own !== undefined) return setField(doc, of, own, value);
  const outcome = PRECONDITIONS.find((each) => each === field);
  const response = RESPONSES.find((each) => each === value);
  return outcome !== undefined && response !== undefined && setResponse(doc, of, outcome, response);
}
