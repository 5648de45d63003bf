/** The values of a number as a line of steps, each as wide as the next. A table beside it says the same. */
import { authorName } from "../../api/graphs";
import { runNumbers, type ValueSpan } from "./value-spans";
import style from "./values.module.css";

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

interface Props {
  spans: readonly ValueSpan[];
  colorOf: (person: string) => string;
  /** The moment that is looked at. */
  at: number;
}

export function ValueChart({ spans: all, colorOf, at }: Props) {
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
