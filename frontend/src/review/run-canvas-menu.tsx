/** The menu of one action or arrow on the canvas of a run. */
import { Button, Popover } from "@mantine/core";
import { useWindowEvent } from "@mantine/hooks";
import { IconPlayerSkipForward } from "@tabler/icons-react";
import { useVersions } from "../api/graphs";
import type { Run } from "../api/runs";
import { fullName, type Graph, type Position } from "../graph/model";
import { spokenName } from "../graph/spoken-name";
import { isOpened } from "../status/earlier-list";
import { RunPoint } from "../status/run-point";
import { keyOf } from "../ui/keys";
import { isolated } from "../words/isolated";
import style from "./run-canvas-menu.module.css";
import type { RepeatActions } from "./run-menu";

export interface RunCanvasPlace {
  /** The action or relation. */
  readonly id: string;
  readonly screen: Position;
}

interface Props {
  run: Run;
  /** The graph that was sent with it. */
  graph: Graph;
  place: RunCanvasPlace;
  /** The engines for another start. */
  engines: readonly string[];
  onStart: (again: RepeatActions) => void;
  onClose: () => void;
}

/** Return whether there is something to do at a place of a run. */
export function hasRunMenu(run: Run, graph: Graph, id: string): boolean {
  const goes = run.ended_at === null;
  if (goes) return Boolean(run.robots) && run.desired !== "stopped";
  return run.graph !== null && !isOpened(run) && graph.actions.some(({ key }) => key === id);
}

export function RunCanvasMenu({ run, graph, place, engines, onStart, onClose }: Props) {
  const action = graph.actions.find(({ key }) => key === place.id);
  const [left, top] = place.screen;
  // Also where the focus was on a button that is not there any more.
  useWindowEvent("keydown", (event) => {
    if (keyOf(event) === "Escape") onClose();
  });
  return (
    <Popover
      opened
      onChange={(opened) => {
        if (!opened) onClose();
      }}
      position="bottom-start"
      offset={2}
      trapFocus
      returnFocus
      withinPortal
    >
      <Popover.Target>
        <span className={style.spot} style={{ left, top }} />
      </Popover.Target>
      <Popover.Dropdown
        className={`${style.menu} fingers`}
        aria-label="What can be done here"
        onContextMenu={(event) => event.preventDefault()}
      >
        {run.ended_at === null ? (
          <RunPoint run={run} graph={graph} id={place.id} />
        ) : (
          action &&
          hasRunMenu(run, graph, place.id) && (
            <RunFromHere
              {...{ run, engines, action: fullName(action) }}
              onStart={(again) => {
                onClose();
                onStart(again);
              }}
            />
          )
        )}
      </Popover.Dropdown>
    </Popover>
  );
}

interface RunFromHereProps extends Pick<Props, "run" | "engines" | "onStart"> {
  action: string;
}

/** Asks for another run that begins with an action; the outcomes and values of a led run count. */
function RunFromHere({ run, engines, action, onStart }: RunFromHereProps) {
  const graph = run.graph ?? "";
  const versions = useVersions(graph, run.version).data;
  const version = versions?.find(({ id }) => id === run.version);
  const earlier = run.robots ? { run: run.id, number: run.number } : { run: "", number: 0 };
  return (
    <Button
      variant="default"
      leftSection={<IconPlayerSkipForward size={15} aria-hidden />}
      disabled={version === undefined}
      onClick={() =>
        version &&
        onStart({
          ...{ graph, name: run.graph_name, engines, robots: run.robots, values: run.values },
          seq: version.seq,
          beginning: { ...earlier, at: [action], only: false },
        })
      }
    >
      Run from {isolated(spokenName(action))} …
    </Button>
  );
}
