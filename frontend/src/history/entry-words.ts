/**
 * Describes what an entry of the history changed, in words about actions, arrows and notes. Pure.
 */
import type { HistoryEntry } from "../api/history";
import { type FieldChange, linesOf } from "../differences/difference-words";
import { fieldWords, shortText } from "../graph/field-words";
import { PRECONDITIONS } from "../graph/model";
import { spokenName } from "../graph/spoken-name";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";

/**
 * `looks`: only where things stand, which means nothing to a robot. `said`: notes and comments. `overwritten`: a
 * value that never stood, since somebody else had set another one without knowing of it.
 */
type LineSign = "added" | "removed" | "changed" | "overwritten" | "looks" | "said";

export interface LinePart {
  readonly kind: "text" | "name" | "old" | "new";
  readonly text: string;
}

export interface EntryLine {
  readonly sign: LineSign;
  readonly parts: readonly LinePart[];
  /** The action, arrow or note that it is about, by its key. */
  readonly of: string | null;
}

type SittingChanges = NonNullable<HistoryEntry["changes"]>;
type ChangedAction = NonNullable<SittingChanges["actions"]>[number];
type ChangedArrow = NonNullable<SittingChanges["relations"]>[number];
type ChangedNote = NonNullable<SittingChanges["notes"]>[number];

const LONGEST = 60; // letters of a value

const text = (words: string): LinePart => ({ kind: "text", text: words });
const name = (words: string): LinePart => ({ kind: "name", text: words });
const short = (value: string): string => shortText(value, LONGEST);

/** From what to what, without a side on which nothing stood. */
function fromTo(before: string | null, after: string | null): LinePart[] {
  const old =
    before === null || before === "" ? null : ({ kind: "old", text: short(before) } as const);
  const is = after === null || after === "" ? null : ({ kind: "new", text: short(after) } as const);
  if (old === null) return is === null ? [] : [text(" "), is];
  return [text(" "), old, text(" → "), is ?? text("nothing")];
}

function actionLines(action: ChangedAction, arrows: number): EntryLine[] {
  const of = action.aid;
  const spoken = name(spokenName(action.name));
  if (action.change === "added") return [{ sign: "added", of, parts: [text("added "), spoken] }];
  if (action.change === "removed") {
    const its =
      arrows === 0 ? [] : [text(` and its ${arrows === 1 ? "arrow" : `${arrows} arrows`}`)];
    return [{ sign: "removed", of, parts: [text("removed "), spoken, ...its] }];
  }
  const renamed = action.fields.find(({ field }) => field === "name");
  const waits = action.fields.filter(isBreakpoint);
  const others = action.fields.filter(
    (field) => !["name", "position"].includes(field.field) && !isBreakpoint(field),
  );
  const set = linesOf(others).map(
    (line): EntryLine => ({
      sign: "changed",
      of,
      parts: [
        text("set "),
        spoken,
        text(` ${line.name.replace(/^input /, "")}`),
        ...fromTo(line.before, line.after),
      ],
    }),
  );
  const lines = [...waits.map((field) => breakpointLine(field, of, [spoken])), ...set];
  if (renamed === undefined) return lines;
  const was = { kind: "old", text: spokenName(String(renamed.before)) } as const;
  return [{ sign: "changed", of, parts: [text("renamed "), was, text(" to "), spoken] }, ...lines];
}

/** `when true or false`, and what then happens unless that is the usual: it runs. */
export function whenWords(when: readonly (readonly [outcome: string, response: string])[]): string {
  const responses = [...new Set(when.map(([, response]) => response))];
  return responses
    .map((response) => {
      const outcomes = when.flatMap(([on, then]) =>
        then === response ? [on.replace(/^on_/, "")] : [],
      );
      return `when ${outcomes.join(" or ")}${response === "run" ? "" : `: ${response}`}`;
    })
    .join(", ");
}

const isOutcome = ({ field }: FieldChange): boolean => PRECONDITIONS.some((on) => on === field);
const isBend = ({ field }: FieldChange): boolean => field.startsWith("waypoints/");

function outcomeLine(field: FieldChange, of: string, ends: readonly LinePart[]): EntryLine {
  const when = text(` ${fieldWords(field.field)}`);
  const [was, is] = [String(field.before), String(field.after)];
  if (was === "ignore") {
    const then = is === "run" ? [] : [text(`: ${is}`)];
    return { sign: "added", of, parts: [text("connected "), ...ends, when, ...then] };
  }
  if (is === "ignore")
    return { sign: "removed", of, parts: [text("disconnected "), ...ends, when] };
  return { sign: "changed", of, parts: [text("set "), ...ends, when, ...fromTo(was, is)] };
}

const isBreakpoint = ({ field }: FieldChange): boolean => field === "breakpoint";

/** A breakpoint is said as such: its value is JSON, which says nothing to people. */
function breakpointLine(field: FieldChange, of: string, where: readonly LinePart[]): EntryLine {
  const [was, is] = [field.before ?? null, field.after ?? null];
  const sign = was === null ? "added" : is === null ? "removed" : "changed";
  const did = { added: "set a", removed: "removed the", changed: "changed the" }[sign];
  return { sign, of, parts: [text(`${did} breakpoint at `), ...where] };
}

function arrowLines(arrow: ChangedArrow): EntryLine[] {
  const of = arrow.ends.join(">");
  const ends = [name(spokenName(arrow.parent)), text(" → "), name(spokenName(arrow.child))];
  if (arrow.change !== "changed") {
    const words = arrow.when.length === 0 ? [] : [text(` ${whenWords(arrow.when)}`)];
    const did = text(arrow.change === "added" ? "connected " : "removed the arrow ");
    return [{ sign: arrow.change, of, parts: [did, ...ends, ...words] }];
  }
  const others = arrow.fields.filter(
    (field) => !isOutcome(field) && !isBend(field) && !isBreakpoint(field),
  );
  return [
    ...arrow.fields.filter(isBreakpoint).map((field) => breakpointLine(field, of, ends)),
    ...arrow.fields.filter(isOutcome).map((field) => outcomeLine(field, of, ends)),
    ...linesOf(others).map((line): EntryLine => {
      const set = [text("set "), ...ends, text(` ${line.name}`)];
      const parts = [...set, ...fromTo(line.before, line.after)];
      return { sign: "changed", of, parts };
    }),
  ];
}

const NOTED = { added: "wrote", removed: "removed", changed: "changed" } as const;

function noteLine(note: ChangedNote): EntryLine {
  const said = note.text === "" ? "" : ` “${short(note.text.replace(/\s+/g, " "))}”`;
  const of = `g/${note.id}`;
  return { sign: "said", of, parts: [text(`${NOTED[note.change]} a note${said}`)] };
}

function graphLines(fields: readonly FieldChange[]): EntryLine[] {
  return linesOf(fields).map((line) => {
    if (line.name === "name") {
      const parts = [text("renamed the graph"), ...fromTo(line.before, line.after)];
      return { sign: "changed", of: null, parts };
    }
    const sign = line.name === "direction" ? "looks" : "changed";
    const words = text(
      sign === "looks" ? "turned the drawing" : `set the graph's ${isolated(line.name)}`,
    );
    const values = sign === "looks" ? [] : fromTo(line.before, line.after);
    return { sign, of: null, parts: [words, ...values] };
  });
}

/** Return one line for changes of looks only, such as positions. */
function looksLine(
  actions: readonly ChangedAction[],
  arrows: readonly ChangedArrow[],
  notes: readonly ChangedNote[],
): EntryLine[] {
  const moved = actions.filter(
    ({ change, fields }) =>
      change === "changed" && fields.some(({ field }) => field === "position"),
  ).length;
  const bent = arrows.filter(({ fields }) => fields.some(isBend)).length;
  const papers = notes.filter((note) => note.moved).length;
  const things = [
    ...(moved > 0 ? [counted(moved, "card")] : []),
    ...(papers > 0 ? [counted(papers, "note")] : []),
  ];
  const did = [
    ...(things.length > 0 ? [`moved ${things.join(", ")}`] : []),
    ...(bent > 0 ? [`bent ${counted(bent, "arrow")}`] : []),
  ];
  if (did.length === 0) return [];
  return [{ sign: "looks", of: null, parts: [text(did.join(" and "))] }];
}

const ORDER: readonly LineSign[] = ["added", "removed", "changed", "overwritten", "said", "looks"];

type OverwrittenChanges = NonNullable<SittingChanges["overwritten"]>;

/** The value that was wanted, and the one that stayed. */
function wantedAndStayed(wanted: string | null, stayed: string | null): LinePart[] {
  const is = stayed === null || stayed === "" ? null : stayed;
  const end =
    is === null
      ? [text(", deleted by somebody else at the same time")]
      : [text(", overwritten at once by "), { kind: "new", text: short(is) } as const];
  return [text(" to "), { kind: "old", text: short(wanted || "nothing") }, ...end];
}

/** A field whose values are said; the full names of an action become what people call it. */
function spokenField({ field, before, after }: FieldChange): FieldChange {
  if (field !== "name") return { field, before, after };
  return { field, before: spokenName(String(before)), after: spokenName(String(after)) };
}

/**
 * Return lines for values that this person set while somebody else, without knowing of it, set those that stayed.
 * `before` of a field is the wanted value, `after` the one that stayed.
 */
function overwrittenLines(changes: OverwrittenChanges): EntryLine[] {
  const { fields = [], actions = [], relations = [], notes = [] } = changes;
  const line = (of: string | null, ...parts: readonly LinePart[]): EntryLine => ({
    sign: "overwritten",
    of,
    parts,
  });
  const set = (of: string | null, what: readonly LinePart[], all: readonly FieldChange[]) =>
    linesOf(all).map(({ name: field, before, after }) => {
      const did = text(field === "name" ? "renamed " : "set ");
      const named = field === "name" ? [] : [text(` ${field.replace(/^input /, "")}`)];
      return line(of, did, ...what, ...named, ...wantedAndStayed(before, after));
    });
  const gone = text(", deleted by somebody else at the same time");
  const atOnce = text(", overwritten at once");
  return [
    ...actions.flatMap(({ aid, name: full, change, fields: its }) => {
      const spoken = name(spokenName(full));
      if (change !== "changed") return [line(aid, text("added "), spoken, gone)];
      const moved = its.filter(({ field }) => field === "position").length;
      return [
        ...set(aid, [spoken], its.filter(({ field }) => field !== "position").map(spokenField)),
        ...(moved > 0 ? [line(aid, text("moved "), spoken, atOnce)] : []),
      ];
    }),
    ...relations.flatMap(({ ends, parent, child, change, fields: its }) => {
      const between = [name(spokenName(parent)), text(" → "), name(spokenName(child))];
      const of = ends.join(">");
      if (change !== "changed") return [line(of, text("connected "), ...between, gone)];
      const bends = its.filter(isBend).length;
      return [
        ...set(
          of,
          between,
          its.filter((field) => !isBend(field)),
        ),
        ...(bends > 0 ? [line(of, text("bent "), ...between, atOnce)] : []),
      ];
    }),
    ...set(null, [text("the graph")], fields),
    ...notes.map((note) => {
      const said = note.text === "" ? "" : ` “${short(note.text.replace(/\s+/g, " "))}”`;
      return line(`g/${note.id}`, text(`${note.moved ? "moved" : "wrote"} a note${said}`), atOnce);
    }),
  ];
}

/**
 * Return lines for all changes of a sitting: added and removed things first, changes of looks last.
 */
export function entryLines(changes: SittingChanges): EntryLine[] {
  const { fields = [], actions = [], relations = [], notes = [], comments = 0 } = changes;
  const gone = new Set(actions.flatMap((each) => (each.change === "removed" ? [each.aid] : [])));
  const goesAlong = (arrow: ChangedArrow) =>
    arrow.change === "removed" && arrow.ends.some((end) => gone.has(end));
  const arrowsOf = (aid: string) =>
    relations.filter((arrow) => goesAlong(arrow) && arrow.ends.includes(aid)).length;
  const lines: EntryLine[] = [
    ...actions.flatMap((action) => actionLines(action, arrowsOf(action.aid))),
    ...relations.filter((arrow) => !goesAlong(arrow)).flatMap(arrowLines),
    ...graphLines(fields),
    ...notes.filter((note) => !note.moved).map(noteLine),
    ...looksLine(actions, relations, notes),
    ...(changes.overwritten ? overwrittenLines(changes.overwritten) : []),
  ];
  if (comments > 0) {
    const words = comments === 1 ? "wrote a comment" : `wrote comments in ${comments} threads`;
    lines.push({ sign: "said", of: null, parts: [text(words)] });
  }
  return lines.sort((a, b) => ORDER.indexOf(a.sign) - ORDER.indexOf(b.sign));
}

/** The first lines, and how many are left out. */
export function shortened(
  changes: SittingChanges,
  most: number,
): { lines: EntryLine[]; more: number } {
  const all = entryLines(changes);
  // One line more takes no more room than to say that there is one more.
  const shown = all.length + (changes.more ?? 0) <= most + 1 ? all : all.slice(0, most);
  return { lines: shown, more: all.length - shown.length + (changes.more ?? 0) };
}

/** A line as it is read out. */
export function lineText({ parts }: EntryLine): string {
  return parts.map((part) => part.text).join("");
}
