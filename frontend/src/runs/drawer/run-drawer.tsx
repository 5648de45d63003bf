/** The drawer under the canvas: the run of the graph, once there was one. */
import { IconTimeline } from "@tabler/icons-react";
import type { Run } from "../../api/runs";
import { lazyPart } from "../../ui/parts/lazy-part";
import { PartBoundary } from "../../ui/parts/part-boundary";
import { DrawerFrame } from "./drawer-frame";
import style from "./run-drawer.module.css";
import type { ShownRunProps } from "./shown-run";

/** Loaded while the page rests: graphs are opened to be drawn, too. */
const ShownRun = lazyPart(() => import("./shown-run").then((part) => part.ShownRun));

interface Props extends Omit<ShownRunProps, "run"> {
  /** Undefined until it is known. */
  run: Run | null | undefined;
}

export function RunDrawer(props: Props) {
  const { run, folded } = props;
  if (run === undefined) return <DrawerFrame mode="low" busy />;
  if (run === null) {
    return (
      <DrawerFrame mode="low">
        <div className={style.none}>
          <IconTimeline size={18} aria-hidden />
          <span>
            Not run yet. Hold <b>Start</b> and every action appears here as a lane, while it runs.
          </span>
        </div>
      </DrawerFrame>
    );
  }
  const mode = folded === null ? "alone" : folded ? "low" : "open";
  return (
    <DrawerFrame mode={mode}>
      <PartBoundary>
        <ShownRun {...props} run={run} />
      </PartBoundary>
    </DrawerFrame>
  );
}
