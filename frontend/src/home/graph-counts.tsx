/** Counts of problems and of parts to fill in, for a graph in a list. */
import { IconAlertTriangle, IconLock, IconPencil } from "@tabler/icons-react";
import type { GraphSummary } from "../api/graphs";
import { countWords, type ProblemCounts } from "../graph/problems/problem-kinds";
import style from "./graph-counts.module.css";

/** Return the counts by the server; zeros if it has none. */
function countsOfListed({ wrong = 0, to_fill_in = 0 }: GraphSummary): ProblemCounts {
  return { wrong, fillIn: to_fill_in, warnings: 0 };
}

/** Marks what not everybody may see or edit. */
export function RestrictedMark() {
  const words = "Not everybody may see or edit this";
  return (
    <span className="inline-flex flex-none ink3" title={words}>
      <IconLock size={13} aria-hidden />
      <span className="visually-hidden">{words}</span>
    </span>
  );
}

/**
 * Shows the sizes and problems of a graph. `brief`: numbers alone, where there is little room; they are told in words
 * all the same.
 */
export function GraphCounts({ graph, brief = false }: { graph: GraphSummary; brief?: boolean }) {
  const counts = countsOfListed(graph);
  const words = countWords(counts);
  if (words.length === 0) return graph.restricted ? <RestrictedMark /> : null;
  const { wrong, fillIn } = counts;
  return (
    <span
      className="inline-flex flex-none gap-40 nowrap text-11_5 weight-600"
      title={words.join(", ")}
    >
      {graph.restricted && <RestrictedMark />}
      {wrong > 0 && (
        <span className={style.count} data-kind="wrong">
          <IconAlertTriangle size={13} aria-hidden /> {wrong}{" "}
          <span className={brief ? "visually-hidden" : undefined}>wrong</span>
        </span>
      )}
      {fillIn > 0 && (
        <span className={style.count} data-kind="fill-in">
          <IconPencil size={13} aria-hidden /> {fillIn}{" "}
          <span className={brief ? "visually-hidden" : undefined}>to fill in</span>
        </span>
      )}
    </span>
  );
}
