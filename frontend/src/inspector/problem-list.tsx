/** Lists the problems of a graph (wrong, to fill in, may go wrong) with their places and fixes. */
import { ActionIcon, Button } from "@mantine/core";
import { IconCircleCheck, IconLink, IconStairsDown, IconTool } from "@tabler/icons-react";
import {
  createContext,
  type FocusEvent,
  type KeyboardEvent,
  use,
  useEffect,
  useMemo,
  useState,
} from "react";
import type { Problems } from "../api/graphs";
import { copyLinkTo } from "../edit-actions/clipboard";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { linkToProblem } from "../edit-actions/graph-links";
import { relationId } from "../graph/document-keys";
import { applyExamples, applySafeFixes, exampleFixes, safeFixes } from "../graph/edit/fixes";
import { pathWords } from "../graph/field-words";
import type { Graph } from "../graph/model";
import { dataFlowOf } from "../graph/parameters/data-flow";
import type { CheckedPlaceInside, ProblemKind } from "../graph/problems/problem-kinds";
import { endName } from "../graph/relation-words";
import { spokenName } from "../graph/spoken-name";
import { INTO } from "../status/level-places";
import { focusField } from "../ui/focus-field";
import { keyOf } from "../ui/keys";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import { type CheckedGroup, fieldOfGroup, firstField } from "./fields/field-problems";
import { ProblemNote, tellNothingLeft } from "./fields/problem-note";
import { DataFlowContext } from "./parameters/data-flow";
import { NumberField } from "./parameters/number-rows";
import { ParameterValueField } from "./parameters/parameter-field";
import style from "./problem-list.module.css";

/** Returns the place of a problem in words; empty for the graph as a whole. */
function placeWords(graph: Graph, place: string | null): string {
  if (place === null) return "";
  const relation = graph.relations.find((candidate) => relationId(candidate) === place);
  if (relation)
    return `${isolated(endName(graph, relation.parent))} → ${isolated(endName(graph, relation.child))}`;
  const action = graph.actions.find((candidate) => candidate.key === place);
  return action ? endName(graph, action.key) : "";
}

/** Shows the place of a problem on the canvas and goes to its field; to its card where it has none. */
function jump(context: EditorContext, told: CheckedGroup, place: string): void {
  context.select([place]);
  context.view.show(place.split(">").map((end) => end.split(";")[0] ?? end));
  const field = firstField(told);
  if (field === null) return;
  context.setPanel("details");
  focusField(`${place}|${field}`);
}

/** A problem in whose fields somebody writes, as it was when they began, and the ids of those after it. */
interface Held {
  readonly told: CheckedGroup;
  readonly after: ReadonlySet<string>;
}

const HoldContext = createContext<(told: CheckedGroup | null) => void>(() => {});

/** Returns the problems with the held one at its place, also where it is solved. */
function withHeld(open: readonly CheckedGroup[], held: Held | null): readonly CheckedGroup[] {
  if (held === null) return open;
  if (open.some(({ id }) => id === held.told.id))
    return open.map((each) => (each.id === held.told.id ? held.told : each));
  const at = open.findIndex(({ id }) => held.after.has(id));
  return open.toSpliced(at < 0 ? open.length : at, 0, held.told);
}

const isIn = (graph: Graph, { place, inputs }: CheckedGroup): boolean =>
  graph.actions.some(
    (action) => action.key === place && action.inputs.some(({ path }) => inputs.includes(path)),
  );

const FIELDS = "[data-fill-in] :is(input:not([type=radio], [type=hidden]), textarea)";

/** Goes on to the next field to fill in, where that is what is meant by the key. */
function goOn(event: KeyboardEvent<HTMLElement>): void {
  const { target } = event;
  const key = keyOf(event);
  const isOn = key === "Enter" || (key === "Tab" && !event.shiftKey);
  if (!isOn || !(target instanceof HTMLInputElement || target instanceof HTMLTextAreaElement))
    return;
  if (!target.matches(FIELDS) || target.value === "") return;
  const isOwn = target instanceof HTMLTextAreaElement || target.hasAttribute("aria-haspopup");
  if (key === "Enter" && (isOwn || target.getAttribute("aria-invalid") === "true")) return;
  const fields = [
    ...(target.closest("[data-problems]")?.querySelectorAll<HTMLElement>(FIELDS) ?? []),
  ];
  const next = fields[fields.indexOf(target) + 1];
  if (next === undefined) return;
  event.preventDefault();
  next.focus();
}

/** Fields for the missing values of a problem, which stay as long as somebody is in them. */
function Values({ told }: { told: CheckedGroup }) {
  const hold = use(HoldContext);
  if (told.kind !== "fill-in") return null;
  const onBlur = ({ currentTarget, relatedTarget }: FocusEvent) => {
    if (!currentTarget.contains(relatedTarget)) hold(null);
  };
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: people use its fields, and it only listens to these
    <div data-fill-in onFocus={() => hold(told)} onBlur={onBlur} onKeyDown={goOn}>
      <Fields told={told} />
    </div>
  );
}

/** Numbers of one thing stand in a row. */
function Fields({ told }: { told: CheckedGroup }) {
  const { graph, mayEdit } = useEditorContext();
  const action = graph.actions.find(({ key }) => key === told.place);
  if (!action || !mayEdit) return null;
  const open = action.inputs.filter(({ path }) => told.inputs.includes(path));
  if (open.length === 0) return null;
  if (open.some(({ path }) => path !== told.group)) {
    return (
      <div className={style.row}>
        {open.map((parameter) => (
          <NumberField
            key={parameter.path}
            action={action}
            side="in"
            letter={parameter.path.slice(parameter.path.lastIndexOf("/") + 1)}
            parameter={parameter}
          />
        ))}
      </div>
    );
  }
  return open.map((parameter) => (
    <div key={parameter.path} className={style.value} data-unwritten>
      <ParameterValueField action={action} side="in" parameter={parameter} label={null} />
    </div>
  ));
}

/** Leads to where in a graph inside it is. */
function WayInside({ inside }: { inside: CheckedPlaceInside | undefined }) {
  const { store } = useEditorContext();
  if (inside === undefined) return null;
  const { levels, aids, where } = inside;
  const steps = levels.map((level, i) => ({
    key: aids[i] ?? "",
    name: level.slice(0, level.lastIndexOf("_")),
  }));
  const words = levels.map(spokenName).join(INTO);
  return (
    <button
      type="button"
      className={style.jump}
      onClick={() => store.graphsInside.now()?.show(steps, where?.relation ?? where?.aid ?? null)}
      aria-label={`Show where it is inside ${words}`}
    >
      <IconStairsDown size={13} aria-hidden /> inside {levels.length > 1 && <bdi>{words}</bdi>}
    </button>
  );
}

function ProblemItem({ told }: { told: CheckedGroup }) {
  const context = useEditorContext();
  const { place } = told;
  const words = placeWords(context.graph, place);
  const field = fieldOfGroup(told);
  return (
    <li className={style.problem} data-kind={told.kind} data-code={told.code}>
      <div className="row gap-50">
        {place !== null && words !== "" ? (
          <button
            type="button"
            className={style.jump}
            onClick={() => jump(context, told, place)}
            aria-label={`Show ${words}${told.group === null ? "" : `, ${pathWords(told.group)}`}`}
          >
            {words}
          </button>
        ) : (
          <span className="ink2 weight-500">Graph</span>
        )}
        <WayInside inside={told.problems[0].inside} />
        <Tooltip label="Copy a link to this problem">
          <ActionIcon
            size="sm"
            ml="auto"
            disabled={false}
            aria-label={`Copy a link to ${told.code}`}
            onClick={() => void copyLinkTo(linkToProblem(context.id, told.problems[0], field))}
          >
            <IconLink size={14} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </div>
      <ProblemNote told={told} />
      <Values told={told} />
    </li>
  );
}

const TITLES: Readonly<Record<ProblemKind, string>> = {
  wrong: "Wrong",
  "fill-in": "To fill in",
  warning: "Warnings: it may go wrong",
  note: "Known of this engine",
};

function Part({ kind, told }: { kind: ProblemKind; told: readonly CheckedGroup[] }) {
  const [held, setHeld] = useState<Held | null>(null);
  const { graph } = useEditorContext();
  const open = told.filter((each) => each.kind === kind);
  const isGone = held !== null && !isIn(graph, held.told);
  const here = withHeld(open, isGone ? null : held);
  useEffect(() => {
    if (!isGone) return;
    setHeld(null); // a field that was removed tells of no blur
    // Not the next field: what somebody still types is not meant for it.
    const list = document.querySelector<HTMLElement>("[data-problems]");
    if (list === null || document.activeElement !== document.body) return;
    list.tabIndex = -1;
    list.focus();
  }, [isGone]);
  const hold = (next: CheckedGroup | null) => {
    const at = here.findIndex(({ id }) => id === next?.id);
    const after = new Set(here.slice(at + 1).map(({ id }) => id));
    setHeld(next && { told: next, after });
  };
  if (here.length === 0) return null;
  return (
    <section className={style.part} data-kind={kind} aria-label={TITLES[kind]}>
      <h2>
        {TITLES[kind]} <span className="tabular">{open.length}</span>
      </h2>
      <ul className="list-reset stack gap-50">
        <HoldContext value={hold}>
          {here.map((each) => (
            <ProblemItem key={each.id} told={each} />
          ))}
        </HoldContext>
      </ul>
    </section>
  );
}

/** The problems of what is selected that have no field of their own in its form. */
export function ProblemsHere({ told }: { told: readonly CheckedGroup[] }) {
  const { selection, graph } = useEditorContext();
  const [place, ...others] = selection;
  const action = graph.actions.find(({ key }) => key === place);
  const shown = (field: string | null): boolean => {
    if (field === null) return false;
    const [side, path] = [field.slice(0, field.indexOf("/")), field.slice(field.indexOf("/") + 1)];
    if (side !== "in" && side !== "out") return true;
    const list = side === "in" ? action?.inputs : action?.outputs;
    return list?.some((each) => `${each.path}/`.startsWith(`${path}/`)) ?? false;
  };
  const here = told.filter((each) => each.place === place && !shown(fieldOfGroup(each)));
  if (place === undefined || here.length === 0 || others.length > 0) return null;
  return (
    <section className={style.here} aria-label="Problems of what is selected">
      {here.map((each) => (
        <ProblemNote key={each.id} told={each} />
      ))}
    </section>
  );
}

/** Mends many at once, each as one step of undo. */
function FixAll({ problems }: { problems: Problems["problems"] }) {
  const { doc, mayEdit } = useEditorContext();
  const safe = safeFixes(problems).length;
  const examples = exampleFixes(problems).length;
  if (!mayEdit) return null;
  return (
    <>
      {safe > 1 && (
        <Button
          fullWidth
          mb="sm"
          leftSection={<IconTool size={15} aria-hidden />}
          title="Fixes everything that can be fixed without losing what was drawn. One undo reverts it."
          onClick={() => {
            if (applySafeFixes(doc, problems) === 0) tellNothingLeft();
          }}
        >
          Fix all {safe} safe ones
        </Button>
      )}
      {examples > 1 && (
        <Button
          fullWidth
          mb="sm"
          leftSection={<IconTool size={15} aria-hidden />}
          title="Older files have only examples of values. This makes the examples the values with which a robot acts. Check them afterwards. One undo reverts it."
          onClick={() => {
            if (applyExamples(doc, problems) === 0) tellNothingLeft();
          }}
        >
          Take all {examples} examples as values
        </Button>
      )}
    </>
  );
}

interface Props {
  problems: Problems | undefined;
  told: readonly CheckedGroup[];
  seq: number;
}

export function ProblemList({ problems, told, seq }: Props) {
  const { graph } = useEditorContext();
  const flow = useMemo(() => dataFlowOf(graph), [graph]);
  if (!problems) return <p className={style.checked}>Checking …</p>;
  return (
    <div className={style.list} data-problems>
      {told.every(({ kind }) => kind === "note") && (
        <p className={style.none}>
          <IconCircleCheck size={18} aria-hidden /> No problem found.
        </p>
      )}
      <FixAll problems={problems.problems} />
      <DataFlowContext value={flow}>
        <Part kind="wrong" told={told} />
        <Part kind="fill-in" told={told} />
        <Part kind="warning" told={told} />
        <Part kind="note" told={told} />
      </DataFlowContext>
      <p className={style.checked}>
        Checked at moment {problems.seq}
        {problems.seq < seq && `, now ${seq}: checking again …`}
      </p>
    </div>
  );
}
