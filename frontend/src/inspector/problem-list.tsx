/** What is wrong with the graph, what it would do, where, and what mends it. */
import { ActionIcon, Button, Tooltip } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconCircleCheck, IconLink, IconTool } from "@tabler/icons-react";
import type { Problem, Problems } from "../api/graphs";
import { bySeverity, markedKeyOf } from "../canvas/problem-marks";
import { copyLinkTo } from "../edit-actions/clipboard";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { linkToProblem } from "../edit-actions/graph-links";
import { relationId } from "../graph/document-keys";
import {
  ABOUT,
  applyExamples,
  applyFix,
  applySafeFixes,
  exampleFixes,
  fixOf,
  safeFixes,
} from "../graph/edit/fixes";
import type { Graph } from "../graph/model";
import { endName } from "../graph/relation-words";
import style from "./problem-list.module.css";

/** Where a problem is, as a person would say it; empty for the graph as a whole. */
function placeWords(graph: Graph, place: string | null): string {
  if (place === null) return "";
  const relation = graph.relations.find((candidate) => relationId(candidate) === place);
  if (relation) return `${endName(graph, relation.parent)} → ${endName(graph, relation.child)}`;
  const action = graph.actions.find((candidate) => candidate.key === place);
  return action ? endName(graph, action.key) : "";
}

/** Shows the place of a problem on the canvas and selects it. */
function jump(context: EditorContext, place: string): void {
  context.select([place]);
  context.view.show(place.split(">").map((end) => end.split(";")[0] ?? end));
}

function tellNothing(): void {
  notifications.show({ message: "There was nothing left to fix.", autoClose: 4_000 });
}

function ProblemItem({ problem, jumps }: { problem: Problem; jumps: boolean }) {
  const context = useEditorContext();
  const place = markedKeyOf(problem);
  const words = placeWords(context.graph, place);
  const fix = fixOf(problem);
  const severity = problem.severity === "error" ? "Error" : "Warning";
  return (
    <li className={style.problem} data-severity={problem.severity} data-code={problem.code}>
      <div className={style.head}>
        <b className={style.code}>{problem.code}</b>
        <span className={style.severity}>{severity}</span>
        {jumps && place !== null && words !== "" && (
          <button
            type="button"
            className={style.jump}
            onClick={() => jump(context, place)}
            aria-label={`Show ${words}`}
          >
            {words}
          </button>
        )}
        <Tooltip label="Copy a link to this problem">
          <ActionIcon
            size="sm"
            ml="auto"
            disabled={false}
            aria-label={`Copy a link to ${problem.code}`}
            onClick={() => void copyLinkTo(linkToProblem(context.id, problem))}
          >
            <IconLink size={14} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </div>
      <p>{problem.message}</p>
      {fix !== null && context.mayEdit && (
        <Button
          size="compact-sm"
          mt={6}
          leftSection={<IconTool size={14} aria-hidden />}
          aria-label={`Fix ${problem.code}: ${ABOUT[fix].words}`}
          onClick={() => {
            if (!applyFix(context.doc, problem)) tellNothing();
          }}
        >
          {ABOUT[fix].words}
        </Button>
      )}
    </li>
  );
}

function Items({ problems, jumps }: { problems: readonly Problem[]; jumps: boolean }) {
  return (
    <ul className={style.items}>
      {problems.map((problem, i) => (
        <ProblemItem
          key={`${problem.code} ${problem.where.path ?? ""} ${markedKeyOf(problem) ?? i}`}
          problem={problem}
          jumps={jumps}
        />
      ))}
    </ul>
  );
}

/** The problems of what is selected, with it. */
export function ProblemsHere({ problems }: { problems: Problems | undefined }) {
  const { selection } = useEditorContext();
  const here = bySeverity(problems?.problems ?? []).filter((problem) => {
    const place = markedKeyOf(problem);
    return place !== null && selection.has(place);
  });
  if (here.length === 0 || selection.size > 1) return null;
  return (
    <section className={style.here} aria-label="Problems of what is selected">
      <Items problems={here} jumps={false} />
    </section>
  );
}

interface Props {
  problems: Problems | undefined;
  seq: number;
}

export function ProblemList({ problems, seq }: Props) {
  const context = useEditorContext();
  if (!problems) return <p className={style.checked}>Checking …</p>;
  const order = bySeverity(problems.problems);
  const safe = safeFixes(order).length;
  const examples = exampleFixes(order).length;
  return (
    <div className={style.list}>
      {order.length === 0 && (
        <p className={style.none}>
          <IconCircleCheck size={18} aria-hidden /> No problem found.
        </p>
      )}
      {safe > 1 && context.mayEdit && (
        <Button
          fullWidth
          mb="sm"
          leftSection={<IconTool size={15} aria-hidden />}
          title="Everything that can be mended without losing what was drawn. One undo takes it back."
          onClick={() => {
            if (applySafeFixes(context.doc, order) === 0) tellNothing();
          }}
        >
          Fix all {safe} safe ones
        </Button>
      )}
      {examples > 1 && context.mayEdit && (
        <Button
          fullWidth
          mb="sm"
          leftSection={<IconTool size={15} aria-hidden />}
          title="The examples of old files become the values that a robot acts on. Look at them afterwards; one undo takes it back."
          onClick={() => {
            if (applyExamples(context.doc, order) === 0) tellNothing();
          }}
        >
          Take all {examples} examples as values
        </Button>
      )}
      <Items problems={order} jumps />
      <p className={style.checked}>
        Checked at moment {problems.seq}
        {problems.seq < seq && `, now ${seq}: checking again …`}
      </p>
    </div>
  );
}
