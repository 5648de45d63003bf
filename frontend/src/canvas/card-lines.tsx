/** The lines of a card that show its input parameters; a selected card shows all of them. */
import { IconArrowLeft } from "@tabler/icons-react";
import type { CardRow } from "../graph/parameters/card-rows";
import { isolated } from "../words/isolated";
import style from "./card-lines.module.css";

const TITLES: Readonly<Record<CardRow["kind"], string>> = {
  value: "",
  from: ", from an output",
  open: ", still to fill in",
  none: "",
  seen: ", as the engine reported it",
};

interface LineProps {
  row: CardRow;
  /** The visit that reported the value was inferred, not observed. */
  inferred: boolean;
  /** The value at the earlier of two moments that are compared. */
  old: string | undefined;
  /** The value is another one at the other moment. */
  differs: boolean;
}

function Line({ row, inferred, old, differs }: LineProps) {
  const { name, kind, text } = row;
  const doubt = kind === "seen" && inferred;
  return (
    <div
      className={style.line}
      data-kind={kind}
      data-inferred={doubt || undefined}
      data-differs={differs || undefined}
      title={`${isolated(name)}: ${text}${TITLES[kind]}${doubt ? ", of a visit that was inferred" : ""}`}
    >
      <span className={style.name}>{name}</span>
      <span className={style.value}>
        {kind === "from" && <IconArrowLeft size={11} aria-label="from" />}
        {old !== undefined && <del className={style.old}>{old === "?" ? "nothing" : old}</del>}
        {kind === "open" ? "to fill in" : text}
        {doubt && <span className="visually-hidden"> inferred</span>}
      </span>
    </div>
  );
}

interface Props {
  rows: readonly CardRow[];
  /** The number of lines within the card; the others stand below it while it is selected. */
  most: number;
  selected: boolean;
  inferred: boolean;
  /** Old values by the name of their row; these rows come first. */
  old?: ReadonlyMap<string, string> | undefined;
  /** Names of the rows that differ from the other moment; these rows come first, too. */
  differing?: ReadonlySet<string> | undefined;
}

export function CardLines({ rows: all, most, selected, inferred, old, differing }: Props) {
  const line = (row: CardRow) => (
    <Line
      key={row.name}
      row={row}
      inferred={inferred}
      old={old?.get(row.name)}
      differs={differing?.has(row.name) === true}
    />
  );
  const isFirst = ({ name }: CardRow) => old?.has(name) === true || differing?.has(name) === true;
  const rows = old ? [...all.filter(isFirst), ...all.filter((row) => !isFirst(row))] : all;
  const more = selected ? rows.slice(most) : [];
  return (
    <>
      {rows.length > 0 && <div className={style.lines}>{rows.slice(0, most).map(line)}</div>}
      {more.length > 0 && <div className={style.more}>{more.map(line)}</div>}
    </>
  );
}
