/** One expected course: whether the graph still takes it, where it parts, and what can be done with it. */
import { ActionIcon } from "@mantine/core";
import { IconFlask, IconTrash } from "@tabler/icons-react";
import { Link } from "wouter";
import type { CheckedCourse } from "../api/documents/courses";
import type { Script } from "../api/dry-runs";
import { authorName } from "../api/graphs";
import { Tooltip } from "../ui/floating/tooltip";
import { day, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./courses.module.css";

const SIGNS = { same: "✓", other: "✗", unknown: "?" } as const;
const READ = {
  same: "as expected",
  other: "goes another way",
  unknown: "not looked at in time",
} as const;

interface Props {
  course: CheckedCourse;
  mayEdit: boolean;
  onPlay: (script: Script) => void;
  onDrop: () => void;
}

export function CourseRow({ course, mayEdit, onPlay, onDrop }: Props) {
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
        {why !== "" && <p className={style.why}>{why}</p>}
        {verdict === "unknown" && <p className={style.why}>{READ.unknown}</p>}
        <p className={style.by}>
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
