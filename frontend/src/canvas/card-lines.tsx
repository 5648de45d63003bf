/** What a card says of its inputs: at rest, in a run, and all of it while it is selected. */
import { IconArrowLeft } from "@tabler/icons-react";
import type { CardRow } from "../graph/parameters/card-rows";
import style from "./card-lines.module.css";

const TITLES: Readonly<Record<CardRow["kind"], string>> = {
  value: "",
  from: ", from an output",
  open: ", still to fill in",
  seen: ", as the engine reported it",
};

/** `inferred`: the visit that they belong to was not seen but follows from other things. */
function Line({ row, inferred }: { row: CardRow; inferred: boolean }) {
  const { name, kind, text } = row;
  const doubt = kind === "seen" && inferred;
  return (
    <div
      className={style.line}
      data-kind={kind}
      data-inferred={doubt || undefined}
      title={`${name}: ${text}${TITLES[kind]}${doubt ? ", of a visit that was inferred" : ""}`}
    >
      <span className={style.name}>{name}</span>
      <span className={style.value}>
        {kind === "from" && <IconArrowLeft size={11} aria-label="from" />}
        {kind === "open" ? "to fill in" : text}
        {doubt && <span className="visually-hidden"> inferred</span>}
      </span>
    </div>
  );
}

interface Props {
  rows: readonly CardRow[];
  /** How many stand in the card; the others below it while it is selected. */
  most: number;
  selected: boolean;
  inferred: boolean;
}

export function CardLines({ rows, most, selected, inferred }: Props) {
  const line = (row: CardRow) => <Line key={row.name} row={row} inferred={inferred} />;
  const more = selected ? rows.slice(most) : [];
  return (
    <>
      {rows.length > 0 && <div className={style.lines}>{rows.slice(0, most).map(line)}</div>}
      {more.length > 0 && <div className={style.more}>{more.map(line)}</div>}
    </>
  );
}
