/** What two runs had different before they began. */
import type { Comparison } from "../../api/review";
import { DifferenceView } from "../../history/difference-view";
import style from "./compare-page.module.css";

export function GraphChanges({ found }: { found: Comparison }) {
  const { subgraphs } = found;
  const same =
    subgraphs.length === 0 ? "Both ran exactly the same graph." : "The graph was the same.";
  return (
    <>
      {subgraphs.length > 0 && (
        <p className={style.same}>
          Graphs inside were not the same: <bdi>{subgraphs.join(", ")}</bdi>.
        </p>
      )}
      {found.same_graph ? (
        <p className={style.same}>{same}</p>
      ) : (
        <DifferenceView found={found.graph} label="What changed in the graph" />
      )}
    </>
  );
}
