/** In a few words whether a graph goes as it is expected to: after it was published, before it is merged. */

import { type CheckedCourses, useCheckedCourses, useCoursesOfText } from "../api/courses";
import { errorText } from "../api/http";
import style from "./courses.module.css";

const MOST = 5; // that are named

interface ToldProps {
  found: CheckedCourses | undefined;
  error: Error | null;
}

function Told({ found, error }: ToldProps) {
  if (error) return <p className={style.told}>Expected courses: {errorText(error)}</p>;
  if (found === undefined) return <p className={style.told}>Checking the expected courses …</p>;
  const { courses } = found;
  if (courses.length === 0) return null;
  const other = courses.filter(({ same }) => same === false);
  const unknown = courses.filter(({ same }) => same === null).length;
  const all =
    courses.length === 1 ? "The expected course" : `All ${courses.length} expected courses`;
  if (other.length === 0 && unknown === 0) {
    return (
      <p className={style.told} data-verdict="same">
        <i aria-hidden>✓</i> {all} {courses.length === 1 ? "is" : "are"} taken.
      </p>
    );
  }
  return (
    <div className={style.told} data-verdict={other.length > 0 ? "other" : "unknown"}>
      {other.length > 0 && (
        <p>
          <i aria-hidden>✗</i> {other.length} of {courses.length} expected courses{" "}
          {other.length === 1 ? "goes" : "go"} another way:
        </p>
      )}
      <ul>
        {other.slice(0, MOST).map(({ name, why }) => (
          <li key={name}>
            <b>
              <bdi>{name}</bdi>
            </b>
            . {why}
          </li>
        ))}
        {other.length > MOST && <li>and {other.length - MOST} more</li>}
      </ul>
      {unknown > 0 && <p>{unknown} could not be checked in time.</p>}
    </div>
  );
}

/** Results of expected courses at a moment of the graph. */
export function CoursesAt({ graph, seq }: { graph: string; seq: number }) {
  const { data, error } = useCheckedCourses(graph, seq);
  return (
    <div role="status">
      <Told found={data} error={error} />
    </div>
  );
}

/** Results of expected courses for a text that the graph may become; `of` is its cache key. */
export function CoursesOfText(props: { graph: string; umrf: string; of: readonly unknown[] }) {
  const { data, error } = useCoursesOfText(props.graph, props.umrf, props.of);
  return (
    <div role="status">
      <Told found={data} error={error} />
    </div>
  );
}
