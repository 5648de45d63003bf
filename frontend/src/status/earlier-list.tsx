/** The place where a run begins, if not at the entry, and all that it takes for granted then. */
import type { ReactNode } from "react";
import type { Run } from "../api/runs";
import type { Earlier, StartFrom } from "../api/starts";
import { spokenName } from "../graph/spoken-name";
import { ago, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./earlier-list.module.css";

/** The place where a start begins. `run`, `number`: the earlier run, "" and 0 for none; `at`: full names of the
 * actions, none if that run is continued where it ended; `opened`: its version, if that run had opened its sub-graphs. */
export interface Beginning {
  readonly run: string;
  readonly number: number;
  readonly at: readonly string[];
  readonly only: boolean;
  readonly opened?: string;
}

/** Return whether the actions inside of sub-graphs were steps of their own: the version has none of these. */
export function isOpened({ actions }: Pick<Run, "actions">): boolean {
  return Object.values(actions ?? {}).some(({ levels }) => levels);
}

/** Return what a start that continues a run says of the sub-graphs that it had opened. */
export function openedIn(run: Pick<Run, "actions" | "version">): Pick<Beginning, "opened"> {
  return isOpened(run) && run.version ? { opened: run.version } : {};
}

export type Choice = NonNullable<StartFrom["choices"]>[string];

/** The choices for an action that was under way, in words. */
export const CHOICES: readonly (readonly [Choice, string])[] = [
  ["again", "Again: it begins once more"],
  ["true", "Done, with true"],
  ["false", "Done, with false"],
  ["error", "Done, with error"],
  ["leave", "Do not go on: nothing follows from it"],
];
const SHOWN = 8; // lines of a list before it is folded

/** Return where a start begins, for the title of its dialog: "Continue run 12", "Run from Lift 0". */
export function beginningWords({ number, at, only }: Beginning): string {
  if (at.length === 0) return `Continue run ${number}`;
  const names = at.length > 2 ? `${at.length} actions` : at.map(nameOf).join(" and ");
  return `${only ? "Run only" : "Run from"} ${names}`;
}

/** Return whether a run may be continued where it ended; the look before that says more. */
export function canContinue(run: Pick<Run, "robots" | "ended_at" | "state" | "graph">): boolean {
  const isLeft = run.state !== "finished" && run.state !== "refused";
  return Boolean(run.robots) && run.ended_at !== null && isLeft && run.graph !== null;
}

/** Return in words where a run began, if not at the entry: "continues run 12", "from Lift 0". */
export function fromWords({ number = 0, at = [], only = false }: NonNullable<Run["from"]>): string {
  if (at.length === 0) return `continues run ${number}`;
  const names = at.slice(0, 3).map(nameOf).join(", ");
  const more = at.length > 3 ? ` and ${at.length - 3} more` : "";
  const after = number > 0 ? `, after run ${number}` : "";
  return `${only ? "only" : "from"} ${names}${more}${after}`;
}

const nameOf = (action: string) => isolated(spokenName(action));

function Lines({ title, lines }: { title: string; lines: readonly ReactNode[] }) {
  if (lines.length === 0) return null;
  const list = (
    <ul>
      {lines.map((line, i) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: lines have no state, and their order never changes
        <li key={i}>{line}</li>
      ))}
    </ul>
  );
  return lines.length > SHOWN ? (
    <details className={style.lines}>
      <summary>
        {title}: {lines.length}
      </summary>
      {list}
    </details>
  ) : (
    <div className={style.lines}>
      <h4>{title}</h4>
      {list}
    </div>
  );
}

/** Lists all that a run takes for granted, with the age of each outcome and value. */
export function EarlierList({ earlier }: { earlier: Earlier }) {
  const now = useNow(10_000);
  const age = (at: string | null) => {
    const when = instant(at);
    return when === null ? "" : `, ${ago(when, now)}`;
  };
  const { assumed, values, skipped, ended_by, choices } = earlier;
  return (
    <>
      <Lines
        title="Counts as ended"
        lines={assumed.map(({ action, outcome, at, by: stated }) => (
          <>
            {isolated(spokenName(action))}:{" "}
            {outcome === null ? <b className="ink-warn">no run shows it</b> : outcome}
            {age(at)}
            {stated !== "" && `, by the word of ${isolated(stated)}`}
          </>
        ))}
      />
      <Lines
        title="Values of before"
        lines={values.map(({ action, name, source, text, at }) => (
          <>
            {isolated(spokenName(action))} {isolated(name)} = <bdi>{text}</bdi>, from{" "}
            {isolated(spokenName(source))}
            {age(at)}
          </>
        ))}
      />
      <Lines
        title="Chosen"
        lines={Object.entries(choices).map(([action, choice]) => (
          <>
            {isolated(spokenName(action))}: {CHOICES.find(([value]) => value === choice)?.[1]}
          </>
        ))}
      />
      <Lines title="Skipped" lines={skipped.map(nameOf)} />
      <Lines
        title="Nothing here stops it"
        lines={ended_by.map(({ action, by }) => (
          <>
            {isolated(spokenName(action))}: only {isolated(spokenName(by))} would, which is skipped
          </>
        ))}
      />
    </>
  );
}
