/** Whether actions of a simulated run do what their Python behaviours say, where the administrator has
 * named a folder of them. The page chooses and never sends any. */
import { Text } from "@mantine/core";
import { type ReactNode, useState } from "react";
import { useLive } from "../../api/live/use-live";
import { useRosReach } from "../../api/robots";
import style from "./start-dialog.module.css";

const NAMED = 6;

function listed(names: readonly string[]): string {
  const more = names.length - NAMED;
  return names.slice(0, NAMED).join(", ") + (more > 0 ? ` and ${more} more` : "");
}

function BehavioursChoice(props: { on: boolean; onChange: (on: boolean) => void }) {
  const { runner } = useLive();
  const there = useRosReach(runner).data?.behaviours ?? null;
  if (there === null) return null;
  const refused = Object.values(there.refused);
  return (
    <fieldset className={style.where}>
      <legend>What actions do</legend>
      <label className={style.choice} data-on={!props.on || undefined}>
        <input
          type="radio"
          name="behaviours"
          checked={!props.on}
          onChange={() => props.onChange(false)}
        />
        <span className={style.name}>Simulated</span>
        <span className={style.quiet}>each takes a second and succeeds</span>
      </label>
      <label className={style.choice} data-on={props.on || undefined}>
        <input
          type="radio"
          name="behaviours"
          checked={props.on}
          onChange={() => props.onChange(true)}
        />
        <span className={style.name}>Python behaviours</span>
        <span className={style.quiet}>{listed(there.names) || "none yet"}</span>
      </label>
      {(there.problem !== "" || refused.length > 0) && (
        <Text size="sm" c="dimmed">
          {[there.problem, ...refused].join(" ").trim()}
        </Text>
      )}
    </fieldset>
  );
}

/** Whether behaviours were chosen, and what they are chosen with; neither where nothing is simulated. */
export function useBehaviours(simulated: boolean): { behaviours: boolean; choice: ReactNode } {
  const [chosen, choose] = useState(false);
  const choice = simulated ? <BehavioursChoice on={chosen} onChange={choose} /> : null;
  return { behaviours: chosen && simulated, choice };
}
