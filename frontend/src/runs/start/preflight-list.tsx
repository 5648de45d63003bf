/** What was looked at on one engine, item by item, in words. */

import { Loader } from "@mantine/core";
import { IconAlertTriangle, IconCheck, IconX } from "@tabler/icons-react";
import type { Preflight, PreflightItem } from "../../api/robots";
import { SIMULATOR } from "../../api/robots";
import { colorOfName } from "../../ui/name-colors";
import { isolated } from "../../words/isolated";
import { IndexWriting } from "./index-writing";
import { InsideRemedies, type MomentLookedAt } from "./inside-remedies";
import style from "./preflight-list.module.css";

const WAITING: Readonly<Record<string, string>> = {
  graph: "The graph and its hazards",
  free: "No other run there",
  answers: "An answer to a question asked now",
  proof: "A stop can be proven",
  actions: "Its actions, with the same parameters",
  again: "It survives a start of this name",
  quiet: "Nothing else runs",
  others: "Nobody else starts things",
  actors: "Whose actions these are",
  courses: "It goes as expected",
};

const SIGNS = { passed: IconCheck, warned: IconAlertTriangle, blocked: IconX } as const;
const READ = { passed: "Fine", warned: "Note", blocked: "In the way" } as const;

interface PreflightLineProps {
  item: PreflightItem;
  look: Preflight;
  moment: MomentLookedAt;
}

function Line({ item, look, moment }: PreflightLineProps) {
  const Sign = SIGNS[item.verdict];
  return (
    <li className={style.line} data-verdict={item.verdict}>
      <Sign size={15} stroke={2.4} aria-hidden className={style.sign} />
      <span>
        <span className="visually-hidden">{READ[item.verdict]}: </span>
        {item.text}
        {item.verdict === "warned" && item.problems.length > 0 && (
          <details className={style.more}>
            <summary>Which</summary>
            <ul>
              {item.problems.map((problem, i) => (
                // biome-ignore lint/suspicious/noArrayIndexKey: a list is replaced as a whole
                <li key={i}>
                  <b>{problem.code}</b> {problem.message}
                </li>
              ))}
            </ul>
          </details>
        )}
        {item.code === "subgraphs" && (
          <IndexWriting item={item} look={look} robot={look.engine} {...moment} />
        )}
        <InsideRemedies item={item} look={look} {...moment} />
      </span>
    </li>
  );
}

interface Props {
  engine: string;
  /** The only engine: its name needs no heading. */
  alone: boolean;
  look: Preflight | undefined;
  moment: MomentLookedAt;
}

export function PreflightList({ engine, alone, look, moment }: Props) {
  const codes = engine === SIMULATOR ? ["graph"] : Object.keys(WAITING);
  return (
    <div className={style.engine}>
      {!alone && (
        <h4 className={style.name}>
          <i style={{ background: colorOfName(engine) }} aria-hidden /> {engine}
        </h4>
      )}
      <ul className={style.list} aria-label={`Looked at on ${isolated(engine)}`}>
        {look
          ? look.items.map((item) => (
              <Line key={item.code} item={item} look={look} moment={moment} />
            ))
          : codes.map((code) => (
              <li key={code} className={style.line} data-verdict="waiting">
                <Loader size={13} color="var(--ink3)" className={style.sign ?? ""} />
                {WAITING[code]}
              </li>
            ))}
      </ul>
    </div>
  );
}
