/** The tests of a graph: expected courses, whether it still takes them, and what none of them takes. */
import { ActionIcon, Button, Progress, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconFlask, IconTrash } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import { Link } from "wouter";
import {
  type CheckedCourse,
  type CheckedCourses,
  dropCourse,
  refreshCourses,
  useCheckedCourses,
} from "../api/courses";
import type { Script } from "../api/dry-runs";
import { authorName } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { endName } from "../graph/relation-words";
import { day, useNow } from "../ui/times";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import style from "./courses.module.css";
import { isThere, UntakenList, untakenPlaces } from "./untaken-list";

/** While this is open, the canvas says what no course takes; in a dry-run it has something else to say. */
function useUntakenOnCanvas(
  { graph, past, dryRun, store: { untaken } }: EditorContext,
  found: CheckedCourses | undefined,
): void {
  const shows = past === null && dryRun === null && found !== undefined && found.courses.length > 0;
  const places = useMemo(
    () => (shows && found ? untakenPlaces(graph, found) : null),
    [graph, shows, found],
  );
  useEffect(() => {
    untaken.set(places);
    return () => untaken.set(null);
  }, [untaken, places]);
}

function Covered({ found: { coverage, courses } }: { found: CheckedCourses }) {
  const { arrows, taken } = coverage;
  if (arrows === 0 || courses.length === 0) return null;
  return (
    <div className={style.covered}>
      <Progress value={(100 * taken) / arrows} aria-label="Outcomes that are taken" />
      <p>
        {taken} of {arrows} outcomes of arrows are taken
      </p>
    </div>
  );
}

function Nothing({ context }: { context: EditorContext }) {
  return (
    <div className={style.nothing}>
      <p>
        An expected course says how this graph has to run. Every later version is checked against
        it, at each start and without a robot.
      </p>
      <p>
        Make one from a dry-run here, or from a run that went well: Run again, Expect this course.
      </p>
      <Button
        size="compact-sm"
        variant="light"
        leftSection={<IconFlask size={14} aria-hidden />}
        disabled={context.graph.actions.length === 0 || context.past !== null}
        onClick={() => context.beginDryRun()}
      >
        Begin a dry-run
      </Button>
    </div>
  );
}

function Unvisited({ found, context }: { found: CheckedCourses; context: EditorContext }) {
  const { graph } = context;
  const keys = found.coverage.unvisited.filter((key) =>
    graph.actions.some((action) => action.key === key),
  );
  if (keys.length === 0) return null;
  const show = (key: string) => {
    context.select([key]);
    context.view.show([key]);
  };
  return (
    <section aria-label="Never run">
      <h3 className={style.heading}>Never run</h3>
      <p className={style.names}>
        {keys.map((key) => (
          <button key={key} type="button" className={style.jump} onClick={() => show(key)}>
            <bdi>{endName(graph, key)}</bdi>
          </button>
        ))}
      </p>
    </section>
  );
}

export function CoursesPanel({ seq }: { seq: number }) {
  const context = useEditorContext();
  const { id, graph } = context;
  const { runner } = useLive();
  const client = useQueryClient();
  const { data: found, error } = useCheckedCourses(id, seq);
  useUntakenOnCanvas(context, found);
  if (error) return <p role="alert">{errorText(error)}</p>;
  if (found === undefined || runner === undefined) return <Skeleton height={120} />;
  const { courses, coverage } = found;
  const refresh = () => refreshCourses(client);
  const drop = (name: string) =>
    dropCourse(runner, name).then(refresh, (refused) =>
      notifications.show({ color: "red", title: "Not dropped", message: errorText(refused) }),
    );
  const untaken =
    courses.length === 0 ? [] : coverage.untaken.filter((each) => isThere(graph, each));
  return (
    <div className="stack gap-75" data-courses>
      <h2 className={style.title}>Expected courses</h2>
      {courses.length === 0 && <Nothing context={context} />}
      <ul className={style.list} aria-label="Expected courses">
        {courses.map((course) => (
          <CourseRow
            key={course.name}
            course={course}
            mayEdit={context.mayGoBack}
            onPlay={({ behaviours }) => context.beginDryRun(null, behaviours ?? {})}
            onDrop={() => void drop(course.name)}
          />
        ))}
      </ul>
      <Covered found={found} />
      {untaken.length > 0 && (
        <section aria-label="Outcomes that are never taken">
          <h3 className={style.heading}>
            Never taken <span className={style.mark}>∅ on the canvas</span>
          </h3>
          <UntakenList runner={runner} seq={seq} arrows={untaken} onKept={refresh} />
        </section>
      )}
      {courses.length > 0 && <Unvisited found={found} context={context} />}
    </div>
  );
}

const SIGNS = { same: "✓", other: "✗", unknown: "?" } as const;
const READ = {
  same: "as expected",
  other: "goes another way",
  unknown: "not checked in time",
} as const;

interface CourseRowProps {
  course: CheckedCourse;
  mayEdit: boolean;
  onPlay: (script: Script) => void;
  onDrop: () => void;
}

export function CourseRow({ course, mayEdit, onPlay, onDrop }: CourseRowProps) {
  const now = useNow(60_000);
  const { same, name, run, why } = course;
  const verdict = same === null ? "unknown" : same ? "same" : "other";
  return (
    <li className={style.course} data-verdict={verdict} data-course={name}>
      <i className={style.sign} aria-hidden>
        {SIGNS[verdict]}
      </i>
      <div className={style.words}>
        <b>
          <bdi>{name}</bdi>
        </b>
        <span className="visually-hidden">: {READ[verdict]}</span>
        {why !== "" && <p className="text-12_5">{why}</p>}
        {verdict === "unknown" && <p className="text-12_5">{READ.unknown}</p>}
        <p className="quiet-12">
          <bdi>{authorName(course.author)}</bdi>, {day(course.at / 1000, now)}
          {" · "}
          {run === "" ? "from a dry-run" : <Link to={`/runs/${run}`}>its run</Link>}
        </p>
      </div>
      <Tooltip label="Play it on the canvas">
        <ActionIcon
          size="sm"
          aria-label={`Play ${isolated(name)} on the canvas`}
          onClick={() => onPlay(course.script as Script)}
        >
          <IconFlask size={15} aria-hidden />
        </ActionIcon>
      </Tooltip>
      {mayEdit && (
        <Tooltip label="Expect it no more">
          <ActionIcon size="sm" aria-label={`Expect ${isolated(name)} no more`} onClick={onDrop}>
            <IconTrash size={15} aria-hidden />
          </ActionIcon>
        </Tooltip>
      )}
    </li>
  );
}
