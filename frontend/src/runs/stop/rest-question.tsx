/** Asks a person at the robot whether it rests, when the notice beside STOP is pressed, which draws no dialog. */
import { useEffect } from "react";
import { useLive } from "../../api/page-link";
import { useMay } from "../../api/people";
import { needsRestConfirmation } from "../../api/run-stop";
import { useFrontDialog } from "../../ui/front-dialog";
import { lazyPart, OverlayBoundary } from "../../ui/lazy-part";
import { useWatched } from "../../ui/watched";
import { askedRun, mayAnswer } from "./stop-surroundings";

const ConfirmRestDialog = lazyPart(() =>
  import("./confirm-rest-dialog").then((part) => part.ConfirmRestDialog),
);

export function RestQuestion() {
  const may = useMay("operate");
  const { now } = useLive();
  const asked = useWatched(askedRun);
  useEffect(() => {
    mayAnswer.set(may);
    return () => mayAnswer.set(false);
  }, [may]);
  const run = asked === null ? undefined : now.runs.get(asked);
  const over = run === undefined || !needsRestConfirmation(run);
  // What somebody says is about the robot that they looked at: another run is asked about anew.
  useEffect(() => {
    if (over) askedRun.set(null);
  }, [over]);
  useFrontDialog(!over, () => askedRun.set(null));
  return (
    <OverlayBoundary>
      {!over && (
        <ConfirmRestDialog key={run.id} run={run} opened onClose={() => askedRun.set(null)} />
      )}
    </OverlayBoundary>
  );
}
