/** The tests of a graph: expected courses, whether it still takes them, and what none of them takes. */
import { Button, Progress, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconFlask } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useEffect, useMemo } from "react";
import {
  type CheckedCourses,
  dropCourse,
  refreshCourses,
  useCheckedCourses,
} from "../api/documents/courses";
import { errorText } from "../api/http";
import { useLive } from "../api/live/use-live";
import { cardHighlights } from "../canvas/card-highlights";
import { type EditorContext, useEditorContext } from "../edit-actions/editor-context";
import { endName } from "../graph/relation-words";
import { CourseRow } from "./course-row";
import style from "./courses.module.css";
import { UntakenList } from "./untaken-list";
import { isThere, untakenPlaces } from "./untaken-places";

/** While this is open, the canvas says what no course takes; in a dry-run it has something else to say. */
function useUntakenOnCanvas(
  { graph, past, dryRun }: EditorContext,
  found: CheckedCourses | undefined,
): void {
  const shows = past === null && dryRun === null && found !== undefined && found.courses.length > 0;
  const places = useMemo(
    () => (shows && found ? untakenPlaces(graph, found) : null),
    [graph, shows, found],
  );
  useEffect(() => {
    cardHighlights.set({ untaken: places });
    return () => cardHighlights.set({ untaken: null });
  }, [places]);
}

function Covered({ found: { coverage, courses } }: { found: CheckedCourses }) {
  const { arrows, taken } = coverage;
  if (arrows === 0 || courses.length === 0) return null;
  return (
    <div className={style.covered}>
      <Progress value={(100 * taken) / arrows} aria-label="Outcomes that are taken" />
      <p>
        {taken} of {arrows} outcomes of its arrows are taken
      </p>
    </div>
  );
}

function Nothing({ context }: { context: EditorContext }) {
  return (
    <div className={style.nothing}>
      <p>
        An expected course says how this graph has to go. It is held against every later version, at
        each start and without a robot.
      </p>
      <p>Make one of a dry-run here, or of a run that went well: Run again, Expect this course.</p>
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
    <div className={style.panel} data-courses>
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
