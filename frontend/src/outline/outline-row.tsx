/** One row of the outline. */
import { ActionIcon, Menu } from "@mantine/core";
import {
  IconChevronRight,
  IconDots,
  IconFrame,
  IconMessageCircle,
  IconNote,
  IconPlayerPlay,
} from "@tabler/icons-react";
import {
  type ComponentProps,
  type CSSProperties,
  memo,
  type ReactNode,
  useId,
  useState,
} from "react";
import { checkedColor } from "../api/people";
import { useEditorStore, useOpenThreadCount } from "../canvas/editor-store";
import { BreakpointMark } from "../canvas/marks/breakpoint-mark";
import { noteColor } from "../canvas/notes/note-nodes";
import { OutcomeSign, outcomeColor, outcomeWord } from "../canvas/outcome";
import { breakpointWords, readBreakpoint } from "../graph/breakpoints";
import type { Note } from "../graph/edit/notes";
import { cardLines, lineText } from "../graph/field-words";
import type { Action, Relation } from "../graph/model";
import { spokenNote } from "../graph/note-links";
import { shownName } from "../graph/questions";
import { handOverLabel, handOverOf, type RobotOf, robotWord } from "../graph/robots";
import { durationLabel } from "../status/durations";
import type { Progress } from "../status/progress";
import { StateLabel } from "../status/state-label";
import type { PersonHere } from "../sync/use-room";
import { colorOfName, initials } from "../ui/name-colors";
import { isolated } from "../words/isolated";
import style from "./outline.module.css";
import { type RowAction, type RowEditKind, rowActionsOf } from "./row-actions";
import { RowEdit } from "./row-edit";
import type { InsideRow, OutlineItem } from "./rows";

interface Props {
  row: OutlineItem;
  active: boolean;
  selected: boolean;
  progress: Progress | null;
  change: RowEditKind | null;
  /** The name of the action, or of the thing to which the arrow leads. */
  name: string;
  /** The robots of the actions; empty unless the graph has several. */
  robots: RobotOf;
  /** The other people who have it selected. */
  others: readonly PersonHere[] | undefined;
  mayEdit: boolean;
  /** Always the same object, so that a row draws again only when something of it changes. */
  handlers: RowHandlers;
}

/** Calls of a row to the outline. */
export interface RowHandlers {
  flip(id: string): void;
  focus(id: string): void;
  choose(row: OutlineItem): void;
  run(rowAction: RowAction, row: OutlineItem): void;
  done(said: string | null): void;
}

/** Shows that a led run waits at this action. */
export function WaitMark({ action }: { action: Action }) {
  const own = action.missing ? null : readBreakpoint(action.breakpoint);
  if (own === null) return null;
  return <BreakpointMark of={action.key} on="row" words={breakpointWords(own, "action")} />;
}

export function Talk({ of }: { of: string }) {
  const count = useOpenThreadCount(of);
  if (count === 0) return null;
  return (
    <span className={style.talk} title={`${count} open comments`}>
      <IconMessageCircle size={13} aria-hidden /> {count}
      <span className="visually-hidden"> open comments</span>
    </span>
  );
}

export function Others({ people }: { people: readonly PersonHere[] }) {
  return people.map(({ id, name, color }) => (
    <span
      key={id}
      className={style.person}
      style={{ background: checkedColor(color) }}
      title={`${isolated(name || "Guest")} has it selected`}
    >
      <span aria-hidden>{initials(name || "Guest")}</span>
      <span className="visually-hidden"> {isolated(name || "Guest")} has it selected</span>
    </span>
  ));
}

/** An action inside of another one: to look at, and the way to where it is changed. */
function PartWords({ row }: { row: InsideRow }) {
  const { action, progress } = row.part;
  return (
    <span className={style.head}>
      <b>
        <bdi>{shownName(action.name)}</bdi> {action.instanceId}
      </b>
      {progress && (
        <StateLabel tone={progress.tone} word={progress.word} {...durationLabel(progress)} />
      )}
    </span>
  );
}

/** The robot to which an arrow hands over, with its colour; nothing for any other arrow. */
export function HandedTo({ relation, robots }: { relation: Relation; robots: RobotOf }) {
  const hand = handOverOf(relation, robots);
  if (!hand) return null;
  return (
    <span className={style.handed} title={handOverLabel(hand)}>
      <span className="visually-hidden">{handOverLabel(hand)}</span>
      <span aria-hidden>
        <i style={{ background: colorOfName(hand.to) }} />
        <bdi>{hand.to || "any robot"}</bdi>
      </span>
    </span>
  );
}

type WordsProps = Pick<Props, "row" | "progress" | "name" | "robots">;

export function Words({ row, progress, name, robots }: WordsProps) {
  switch (row.kind) {
    case "entry":
      return (
        <span className={style.end}>
          <IconPlayerPlay size={13} aria-hidden /> Entry
        </span>
      );
    case "action": {
      const { action } = row;
      const [line] = cardLines(action.inputs, 1);
      const more = [
        action.missing
          ? "named by an arrow, but not there"
          : robots.size > 0 && robotWord(action.actor),
        line && lineText(line),
        row.follows === 0 && "nothing follows",
      ].filter(Boolean);
      return (
        <>
          <span className={style.head}>
            <b>
              {shownName(action.name)} {action.instanceId}
            </b>
            <WaitMark action={action} />
            <Talk of={action.key} />
            {progress && (
              <StateLabel tone={progress.tone} word={progress.word} {...durationLabel(progress)} />
            )}
          </span>
          {more.length > 0 && <span className="truncate ink2 text-75">{more.join(" · ")}</span>}
        </>
      );
    }
    case "outcome":
      return (
        <span className={style.outcome} style={{ color: outcomeColor[row.outcome] }}>
          <OutcomeSign outcome={row.outcome} /> {outcomeWord[row.outcome]}
        </span>
      );
    case "target":
      return (
        <span className={style.target}>
          <span className="ink2">{row.response}</span> <b>{name}</b>
          {!row.relation.required && <span className="truncate ink2 text-75">optional</span>}
          <HandedTo relation={row.relation} robots={robots} />
        </span>
      );
    case "inside":
      return <PartWords row={row} />;
    case "note": {
      const { kind, text } = row.note;
      const Sign = kind === "frame" ? IconFrame : IconNote;
      return (
        <span className={style.note}>
          <Sign size={13} aria-label={noteWord(row.note)} />
          <span className="truncate ink2 text-75">{spokenNote(text) || "empty"}</span>
        </span>
      );
    }
  }
}

interface RowActionsProps {
  row: OutlineItem;
  active: boolean;
  label: string;
  mayEdit: boolean;
  handlers: RowHandlers;
  /** The content of the button, instead of three dots. */
  chip?: { readonly look: string; readonly words: ReactNode };
}

/** The menu itself is made when it is first opened: there may be thousands of rows. */
export function RowActions(props: RowActionsProps) {
  const { row, active, label, mayEdit, handlers, chip } = props;
  const store = useEditorStore();
  const [opened, setOpened] = useState<boolean | null>(null);
  const button = chip ? (
    <button
      type="button"
      className={chip.look}
      tabIndex={active ? 0 : -1}
      onClick={() => setOpened(!opened)}
    >
      {chip.words}
    </button>
  ) : (
    <ActionIcon
      size={32}
      className={style.more ?? ""}
      tabIndex={active ? 0 : -1}
      aria-label={`What to do with ${isolated(label)}`}
      onClick={() => setOpened(!opened)}
    >
      <IconDots size={16} aria-hidden />
    </ActionIcon>
  );
  if (opened === null) return button;
  return (
    <Menu
      opened={opened}
      onChange={setOpened}
      trapFocus
      returnFocus={false}
      middlewares={ABOVE_STOP}
    >
      <Menu.Target>{button}</Menu.Target>
      <Menu.Dropdown>
        {rowActionsOf(row, store).map((rowAction) => (
          <Menu.Item
            key={rowAction.name}
            disabled={rowAction.changes && !mayEdit}
            rightSection={<kbd className={style.key}>{keyWords(rowAction.key)}</kbd>}
            onClick={() => handlers.run(rowAction, row)}
          >
            {rowAction.label}
            {rowAction.detail && <div className="quiet-12">{rowAction.detail}</div>}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}

/** A menu moves up where STOP would cover its end on a phone. */
const ABOVE_STOP = { flip: true, shift: { crossAxis: true, padding: { bottom: 84 } } };

const keyWords = (key: string): string =>
  key.replace("Arrow", "").replace("Alt+Up", "Alt ↑").replace("Alt+Down", "Alt ↓").toUpperCase();

const noteWord = ({ kind }: Note) => (kind === "frame" ? "Frame" : "Note");

function colorOf(row: OutlineItem): string {
  if (row.kind === "note") return noteColor[row.note.color];
  if (row.kind === "inside") return colorOfName(row.part.action.actor);
  return row.kind === "action" ? colorOfName(row.action.actor) : "transparent";
}

export function labelOf(row: OutlineItem, name: string): string {
  switch (row.kind) {
    case "entry":
      return "Entry";
    case "action":
      return name;
    case "outcome":
      return `${isolated(name)}, ${outcomeWord[row.outcome]}`;
    case "target":
      return `the arrow to ${isolated(name)}`;
    case "inside":
      return row.part.action.name;
    case "note":
      return `${noteWord(row.note)}: ${spokenNote(row.note.text).slice(0, 60) || "empty"}`;
  }
}

/** Return the attributes of the row of a tree grid that are the same in a wide list and on a phone. */
export function rowAttributes(
  props: Pick<Props, "row" | "active" | "selected" | "handlers">,
): ComponentProps<"tr"> {
  const { row, active, selected, handlers } = props;
  return {
    ...{ "data-row": row.id, "data-level": row.level },
    "data-inside": row.kind === "inside" || undefined,
    ...{ "aria-level": row.level, "aria-posinset": row.at, "aria-setsize": row.of },
    "aria-selected": selected,
    tabIndex: active ? 0 : -1,
    style: { "--c": colorOf(row), "--level": row.level } as CSSProperties,
    onFocus: (event) => {
      if (event.target === event.currentTarget) handlers.focus(row.id);
    },
  } as ComponentProps<"tr">;
}

export const OutlineRow = memo(function OutlineRow(props: Props) {
  const { row, active, progress, change, name, robots, others, mayEdit, handlers } = props;
  const label = labelOf(row, name);
  const words = useId();
  return (
    <tr
      className={style.row}
      {...rowAttributes(props)}
      aria-labelledby={words}
      {...(row.open === null ? {} : { "aria-expanded": row.open })}
    >
      <td className={style.words}>
        {row.open === null ? (
          <span className={style.none} />
        ) : (
          <span className={style.flip} data-down={row.open || undefined}>
            <ActionIcon
              size={32}
              tabIndex={-1}
              aria-label={row.open ? "Close" : "Open"}
              onClick={() => handlers.flip(row.id)}
            >
              <IconChevronRight size={15} aria-hidden />
            </ActionIcon>
          </span>
        )}
        <button type="button" id={words} tabIndex={-1} onClick={() => handlers.choose(row)}>
          <Words row={row} progress={progress} name={name} robots={robots} />
        </button>
        {others && row.kind !== "outcome" && <Others people={others} />}
      </td>
      <td className={style.buttons}>
        <RowActions row={row} active={active} label={label} mayEdit={mayEdit} handlers={handlers} />
      </td>
      {change !== null && (
        <td className={style.edit}>
          <RowEdit row={row} change={change} onDone={handlers.done} />
        </td>
      )}
    </tr>
  );
});
