/** At a card or an arrow that changed since a run went well: a quiet sign, which says what on asking. */
import { useBlame } from "../../api/documents/history";
import { authorName } from "../../api/graphs";
import { CHANGE_SIGNS } from "../../canvas/marks/change-marks";
import type { SinceMark, SinceMarks, SinceSignProps } from "../../canvas/marks/since-marks";
import { Tooltip } from "../../ui/floating/tooltip";
import style from "./since-sign.module.css";

interface WordsProps {
  of: string;
  mark: SinceMark;
  since: SinceMarks;
}

/** `Ada changed speed 0.4 → 0.9 since run 41, which went well`. Who that was is asked for only now. */
function SinceWords({ of, mark, since: { graph, run, seq } }: WordsProps) {
  const found = useBlame(graph, of);
  const set = (found.data ?? []).filter(
    (each) => each.seq > seq && (mark.change === "added" || mark.fields.includes(each.field)),
  );
  const names = [...new Set(set.map(({ author }) => authorName(author)))];
  const who = names.length > 2 ? `${names.length} people` : names.join(" and ") || "Somebody";
  const did = mark.change === "added" ? "added it" : `changed ${mark.words}`;
  return (
    <>
      <bdi>{who}</bdi> {did} since run {run}, which went well
    </>
  );
}

export function SinceSign({ of, on, mark, since }: SinceSignProps) {
  return (
    <Tooltip label={<SinceWords {...{ of, mark, since }} />} width={260}>
      <span className={style.sign} data-on={on} data-since={mark.change}>
        <span aria-hidden>{CHANGE_SIGNS[mark.change]}</span>
        <span className="visually-hidden">
          {mark.change} since run {since.run}
        </span>
      </span>
    </Tooltip>
  );
}
