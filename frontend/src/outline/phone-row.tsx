/** One action of the outline on a phone: its name, its values, and one chip for each bundle of arrows. */
import { IconArrowBackUp, IconArrowRight, IconFlag, IconPlus } from "@tabler/icons-react";
import { memo, useId } from "react";
import { OutcomeSign, outcomeColor, outcomeWord } from "../canvas/outcome";
import { cardLines, lineText } from "../graph/field-words";
import { EXIT, type Key, type Precondition } from "../graph/model";
import type { RobotOf } from "../graph/robots";
import { durationLabel } from "../status/durations";
import type { Progress } from "../status/progress";
import { StateLabel } from "../status/state-label";
import type { PersonHere } from "../sync/use-room";
import { colorOfName } from "../ui/name-colors";
import {
  HandedTo,
  labelOf,
  Others,
  RowActions,
  type RowHandlers,
  rowAttributes,
  Talk,
  WaitMark,
  Words,
} from "./outline-row";
import style from "./phone-row.module.css";
import type { RowEditKind } from "./row-actions";
import { RowEdit } from "./row-edit";
import { type BundleRow, leadingNowhere, type OutlineItem } from "./rows";

interface Props {
  row: OutlineItem;
  bundles: readonly BundleRow[];
  active: boolean;
  selected: boolean;
  progress: Progress | null;
  /** The edit that is open in this row, or in one of its bundles. */
  edited: { readonly row: OutlineItem; readonly change: RowEditKind } | null;
  names: ReadonlyMap<Key, string>;
  /** The robots of the actions; empty unless the graph has several. */
  robots: RobotOf;
  /** The index of each row in the list: arrows to rows above lead back. */
  order: ReadonlyMap<string, number>;
  /** The other people who have it selected. */
  others: readonly PersonHere[] | undefined;
  mayEdit: boolean;
  handlers: RowHandlers;
}

const VALUES = 2; // on a line

function Signs({ of }: { of: readonly Precondition[] }) {
  return of.map((outcome) => (
    <span key={outcome} className="inline-flex" style={{ color: outcomeColor[outcome] }}>
      <OutcomeSign outcome={outcome} size={14} />
    </span>
  ));
}

function sentence({ bundled = [], response, relation }: BundleRow, name: string): string {
  const when = bundled.map((outcome) => outcomeWord[outcome]).join(" or ");
  const optional = relation.required ? "" : ", optional";
  return `${when === "" ? "" : `When ${when}: `}${response} ${name}${optional}`;
}

interface BundleProps {
  row: BundleRow;
  name: string;
  back: boolean;
  robots: RobotOf;
}

function Bundle({ row, name, back, robots }: BundleProps) {
  const Way = row.relation.child === EXIT ? IconFlag : back ? IconArrowBackUp : IconArrowRight;
  return (
    <>
      <span className="visually-hidden">{sentence(row, name)}</span>
      <span className={style.shown} aria-hidden>
        <Signs of={row.bundled ?? []} />
        {row.response !== "run" && <b>{row.response}</b>}
        <Way size={14} />
        <bdi className="truncate">{name}</bdi>
      </span>
      <HandedTo relation={row.relation} robots={robots} />
    </>
  );
}

function About(props: Pick<Props, "row" | "progress" | "robots"> & { name: string }) {
  const { row, name, progress, robots } = props;
  if (row.kind !== "action") return <Words {...props} />;
  const { action } = row;
  const lines = cardLines(action.inputs, VALUES).map(lineText).join(" · ");
  const named = action.missing || robots.size > 0;
  return (
    <>
      <span className="row min-w-0 gap-50">
        <bdi className={style.name}>{name}</bdi>
        <WaitMark action={action} />
        <Talk of={action.key} />
        {progress && (
          <StateLabel tone={progress.tone} word={progress.word} {...durationLabel(progress)} />
        )}
      </span>
      <span className="truncate ink2 text-13">
        {action.missing && "named by an arrow, but not there"}
        {!action.missing && robots.size > 0 && (
          <b
            className="weight-600"
            style={{ color: action.actor === "" ? undefined : colorOfName(action.actor) }}
          >
            <bdi>{action.actor || "any robot"}</bdi>
          </b>
        )}
        {named && lines !== "" && " · "}
        {lines}
      </span>
    </>
  );
}

export const PhoneRow = memo(function PhoneRow(props: Props) {
  const {
    row,
    bundles,
    active,
    selected,
    progress,
    edited,
    names,
    robots,
    order,
    others,
    mayEdit,
    handlers,
  } = props;
  const words = useId();
  const name = row.kind === "inside" ? row.part.action.name : (names.get(row.id) ?? "");
  const open = row.kind === "action" && !row.action.missing ? leadingNowhere(bundles) : [];
  const asks = mayEdit && (open.includes("on_true") || (selected && open.length > 0));
  return (
    <tr className={style.row} {...rowAttributes(props)} aria-labelledby={words}>
      <td className={style.words}>
        <button type="button" id={words} tabIndex={-1} onClick={() => handlers.choose(row)}>
          <About row={row} name={name} progress={progress} robots={robots} />
        </button>
        {others && <Others people={others} />}
      </td>
      <td>
        <RowActions
          row={row}
          active={active}
          label={labelOf(row, name)}
          mayEdit={mayEdit}
          handlers={handlers}
        />
      </td>
      {(bundles.length > 0 || asks) && (
        <td className={style.chips}>
          {bundles.map((bundle) => {
            const target = names.get(bundle.relation.child) ?? "";
            const back = (order.get(bundle.relation.child) ?? Infinity) <= (order.get(row.id) ?? 0);
            return (
              <RowActions
                key={bundle.id}
                row={bundle}
                active={active}
                label={target}
                mayEdit={mayEdit}
                handlers={handlers}
                chip={{
                  look: `${style.chip} ${bundle.relation.required ? "" : style.optional}`,
                  words: <Bundle row={bundle} name={target} back={back} robots={robots} />,
                }}
              />
            );
          })}
          {asks && <Connect row={row} open={open} active={active} handlers={handlers} />}
        </td>
      )}
      {edited !== null && (
        <td className={style.edit}>
          <RowEdit row={edited.row} change={edited.change} onDone={handlers.done} />
        </td>
      )}
    </tr>
  );
});

interface ConnectProps {
  row: OutlineItem;
  open: readonly Precondition[];
  active: boolean;
  handlers: RowHandlers;
}

/** Ends that lead nowhere, and the way to lead them somewhere. */
function Connect({ row, open, active, handlers }: ConnectProps) {
  return (
    <button
      type="button"
      className={`${style.chip} ${style.optional} ink-accent`}
      tabIndex={active ? 0 : -1}
      onClick={() => handlers.run(CONNECT, row)}
    >
      <span className="visually-hidden">
        When {open.map((outcome) => outcomeWord[outcome]).join(", ")} nothing follows:
      </span>
      <Signs of={open} />
      <IconPlus size={14} aria-hidden /> connect
    </button>
  );
}

const CONNECT = { name: "connect", label: "Connect …", key: "c", changes: true } as const;
