/** Start: one press in the simulator, where nothing moves; robots are chosen and looked at in a dialog first. */
import { ActionIcon, Button } from "@mantine/core";
import { IconChevronDown, IconPlayerPlayFilled } from "@tabler/icons-react";
import { useState } from "react";
import { useVersions } from "../../api/graphs";
import { errorText } from "../../api/http";
import { CONDUCTED } from "../../api/led-runs";
import { openRuns } from "../../api/live-socket";
import { useLive } from "../../api/page-link";
import { SIMULATOR } from "../../api/robots";
import { lazyPart, OverlayBoundary } from "../../ui/lazy-part";
import { isolated } from "../../words/isolated";
import { StartButton } from "./start-button";
import style from "./start-control.module.css";
import { lastEngines, nextLabel, notifyFailure, useStart } from "./use-start";

const StartDialog = lazyPart(() => import("./start-dialog").then((part) => part.StartDialog));

interface Props {
  graph: string;
  /** The moment that the page shows, as far as it has been named. */
  seq: number;
  /** The name of the moment on screen: others' edits show a little before they are named. */
  settle: () => Promise<number>;
  /** The reason why this moment cannot be started; null when it can. */
  obstacle: string | null;
  /** The counts of problems that are the reason, in words, for a badge; "" without any. */
  blocks: string;
  /** The start asks for values, or its graph asks people or has breakpoints and has to be led: it is looked at
   * first. */
  asks: boolean;
  compact?: boolean;
  /** In two lines, within reach of a thumb. */
  thumb?: boolean;
  look: StartLookState;
}

/**
 * The look before a start of a graph: its moment, null while it is closed, and the chosen engines. Kept
 * above the layouts, which change when a phone is turned: what was chosen stays.
 */
interface StartLookState {
  asking: number | null;
  setAsking: (seq: number | null) => void;
  engines: readonly string[];
  setEngines: (engines: readonly string[]) => void;
}

export function useStartLook(graph: string): StartLookState {
  const [asking, setAsking] = useState<number | null>(null);
  const [engines, setEngines] = useState<readonly string[]>(() => lastEngines(graph));
  return { asking, setAsking, engines, setEngines };
}

/** The dialog of the look before a start, while it is open. */
export function StartLook(props: Pick<Props, "graph" | "look"> & { name: string }) {
  const { graph, name, look } = props;
  const versions = useVersions(graph).data ?? [];
  const { asking, setAsking, engines, setEngines } = look;
  if (asking === null) return null;
  return (
    <OverlayBoundary>
      <StartDialog
        graph={graph}
        name={name}
        seq={asking}
        label={nextLabel(versions, asking)}
        chosen={engines}
        onChosen={setEngines}
        onClose={() => setAsking(null)}
      />
    </OverlayBoundary>
  );
}

function TwoLines({ first, second }: { first: string; second: string }) {
  return (
    <span className={style.lines}>
      <b>{first}</b>
      <span className="ellipsis text-11 weight-500">{second}</span>
    </span>
  );
}

export function StartControl(props: Props) {
  const { graph, seq, settle, obstacle, blocks, asks, compact = false, thumb = false } = props;
  const { engines, setAsking } = props.look;
  const versions = useVersions(graph).data ?? [];
  const { now } = useLive();
  const start = useStart(graph);
  const label = nextLabel(versions, seq);
  const goes = openRuns(now).some((run) => run.graph === graph);
  const why = start.isPending
    ? "Starting …"
    : now.link === "down"
      ? "The runner does not answer"
      : obstacle;
  const simulated = engines.every((engine) => engine === SIMULATOR);
  const icon = <IconPlayerPlayFilled size={13} aria-hidden />;
  const led = engines.includes(CONDUCTED);
  const where = led
    ? "step by step"
    : simulated
      ? "in the simulator"
      : `on ${engines.map(isolated).join(", ")}`;
  const short = led ? "led" : simulated ? "simulator" : where;
  const first = start.isPending
    ? "Starting …"
    : `${simulated ? "Run" : "Start"} ${isolated(label)}`;
  const wide = compact ? first : `${first} ${where} …`;
  const run = `${first} ${where}`;
  const ask = () =>
    void settle().then(setAsking, (error) => notifyFailure("Not started", errorText(error)));
  return (
    <span className={style.start} data-thumb={thumb || undefined}>
      {blocks !== "" && (
        <span className={style.badge} title={`${blocks}: this prevents a start`} aria-hidden>
          {blocks}
        </span>
      )}
      {simulated && !asks ? (
        <StartButton
          icon={thumb ? undefined : icon}
          label={thumb ? <TwoLines first={first} second={short} /> : compact ? first : run}
          name={why === null ? run : `${first}: ${why}`}
          question={
            goes
              ? `A run of this graph is going on already. Run ${isolated(label)} beside it, in the simulator?`
              : null
          }
          disabled={why !== null}
          onStart={() => start.mutate({ seq: settle(), engines: [SIMULATOR], digest: null })}
        />
      ) : (
        <Button
          leftSection={thumb ? undefined : icon}
          className={style.robots ?? ""}
          disabled={why !== null}
          title={
            why ??
            (led
              ? "Look at its robots before starting"
              : `Look ${where.replace(/^on /, "at ")} before starting`)
          }
          onClick={ask}
        >
          <span aria-hidden className={thumb ? "min-w-0" : undefined}>
            {thumb ? <TwoLines first={first} second={`${short} …`} /> : wide}
          </span>
          <span className="visually-hidden">
            {why === null ? `${first} ${where} …` : `${first}: ${why}`}
          </span>
        </Button>
      )}
      <ActionIcon
        variant="default"
        className={style.choose ?? ""}
        aria-label="Choose where to start"
        title="Choose where to start"
        disabled={why !== null}
        onClick={ask}
      >
        <IconChevronDown size={16} aria-hidden />
      </ActionIcon>
    </span>
  );
}
