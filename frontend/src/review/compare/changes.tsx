/** What two runs had different before they began. */
import type { Comparison } from "../../api/review";
import { DifferenceView } from "../../history/difference-view";
import style from "./compare-page.module.css";

export function GraphChanges({ found }: { found: Comparison }) {
  if (found.same_graph) return <p className={style.same}>Both ran exactly the same graph.</p>;
  return <DifferenceView found={found.graph} label="What changed in the graph" />;
}
