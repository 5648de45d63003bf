/** Commands of a person for a led run at one action or arrow of its graph: wait there, or go on until there. */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconHandOff, IconHandStop, IconPlayerTrackNext } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { errorText, isOutcomeUnknown } from "../api/http";
import { enginesOf } from "../api/led-runs";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { letStep, setRunBreakpoints } from "../api/presses";
import type { Run } from "../api/runs";
import { runMarks } from "../graph/breakpoints";
import type { Graph } from "../graph/model";
import { type Place, placeIn, toggledAt } from "../graph/run-breakpoints";
import { spokenName } from "../graph/spoken-name";
import { HoldButton } from "../ui/hold-button";
import { isolated } from "../words/isolated";
import { laterActions } from "./held-notice";
import style from "./run-point.module.css";
import { movesWords, robotsOfRun, useWatching, WatchTicks } from "./watching";

interface Props {
  run: Run;
  /** The graph that was sent with the run; null until it is known. */
  graph: Graph | null;
  /** The chosen action or arrow of that graph. */
  id: string | null;
}

const placeWords = ({ action, to }: Place): string =>
  to === "" ? spokenName(action) : `${isolated(spokenName(action))} → ${isolated(spokenName(to))}`;

/** True if people can set where a run waits: it is led, goes on, and is not being stopped. */
const canSteer = (run: Run): boolean =>
  Boolean(run.robots) && run.ended_at === null && run.desired !== "stopped";

export function RunPoint({ run, graph, id }: Props) {
  const may = useMay(run.simulated ? "simulate" : "operate");
  const place = graph === null || id === null ? null : placeIn(graph, id);
  if (!may || place === null || graph === null || id === null || !canSteer(run)) return null;
  if (run.actions?.[place.action] === undefined) return null; // of a sub-graph that is opened
  return <Steering key={id} {...{ run, graph, id, place }} />;
}

function Steering({ run, graph, id, place }: Props & { graph: Graph; id: string; place: Place }) {
  const { live, runner, now } = useLive(run.id);
  const watch = useWatching(enginesOf(run));
  const all = run.breakpoints ?? [];
  const words = runMarks(graph, all).get(id);
  const [where, away] = [placeWords(place), now.link !== "live"];
  const set = useMutation({
    mutationFn: () =>
      setRunBreakpoints(runner ?? "", run.id, toggledAt(all, place), all, watch.watching),
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error, "The breakpoints are as they were")),
    onSettled: watch.forget,
  });
  const until = useMutation({
    mutationFn: (since: string) =>
      letStep(runner ?? "", run.id, since, { until: place.action }, watch.watching),
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error, "Nothing has begun")),
    onSettled: watch.forget,
  });
  const busy = set.isPending || until.isPending;
  const since = run.held?.since;
  const isAhead =
    place.to === "" && since !== undefined && laterActions(run).includes(place.action);
  const obstacle = busy ? "Asking …" : watch.obstacle;
  const disabled = obstacle !== null || away;
  const moves = movesWords(run);
  const isPress = robotsOfRun(run).length === 0;
  return (
    <section className={style.point} aria-label={`${where} in run ${run.number}`}>
      <b>
        <bdi>{where}</bdi>
      </b>
      {words === undefined ? (
        <Button
          size="compact-sm"
          variant="default"
          leftSection={<IconHandStop size={13} aria-hidden />}
          loading={set.isPending}
          disabled={away || busy}
          aria-label={`Let run ${run.number} wait at ${where}`}
          onClick={() => set.mutate()}
        >
          Wait here in this run
        </Button>
      ) : (
        <>
          <span>{words.replace("A led run", "This run")}.</span>
          <WatchTicks watch={watch} />
          <HoldButton
            size="compact-sm"
            icon={<IconHandOff size={13} aria-hidden />}
            label={obstacle ?? (isPress ? "Do not wait here" : "Hold: do not wait here")}
            isPress={isPress}
            name={`Let run ${run.number} no longer wait at ${where}`}
            question={`Let run ${run.number} no longer wait at ${where}? ${moves}`}
            disabled={disabled}
            onHeld={() => set.mutate()}
          />
        </>
      )}
      {isAhead && (
        <>
          {words === undefined && <WatchTicks watch={watch} />}
          <HoldButton
            size="compact-sm"
            icon={<IconPlayerTrackNext size={13} aria-hidden />}
            label={obstacle ?? (isPress ? "Go on until here" : "Hold to go on until here")}
            isPress={isPress}
            name={`Let run ${run.number} go on until ${where} is about to begin`}
            question={`Let run ${run.number} go on until ${where} is about to begin? ${moves}`}
            disabled={disabled}
            onHeld={() => until.mutate(since)}
          />
        </>
      )}
    </section>
  );
}

function failure(error: unknown, title: string) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) return { color: "red", title, message };
  return { color: "red", autoClose: false as const, title: "NOT KNOWN whether it counts", message };
}
