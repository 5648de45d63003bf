/** Why a run did not end well, at the top of its page: each cause with a way to where it shows. */
import { IconAlertTriangle, IconHandStop } from "@tabler/icons-react";
import { type Cause, needsExplanation, useCauses } from "../../api/review";
import type { Run } from "../../api/runs";
import { placesOf } from "../../status/level-places";
import { clock, instant } from "../../ui/times";
import style from "./causes.module.css";
import { SinceWhenButton } from "./since-when";

interface Props {
  runner: string | undefined;
  run: Run;
  /** Goes to a moment, and to an action as the run calls it. */
  onShow: (at: number, fact: string | null) => void;
}

const SHOWN = 3;

interface CauseLineProps extends Pick<Props, "onShow"> {
  cause: Cause;
  /** The action stands in a graph inside. */
  inside: boolean;
}

function Line({ cause, inside, onShow }: CauseLineProps) {
  const at = instant(cause.at) ?? 0;
  const show = () => onShow(at, cause.action);
  return (
    <li>
      <button type="button" className={style.at} title="Show this moment" onClick={show}>
        {clock(at)}
      </button>
      <span>
        {cause.text}
        {inside && (
          <button type="button" className={style.into} onClick={show}>
            Show it inside
          </button>
        )}
      </span>
    </li>
  );
}

/** Says so, too, when nothing is recorded that would explain it. */
export function FailureCauses({ runner, run, onShow }: Props) {
  const found = useCauses(runner, run).data;
  if (!needsExplanation(run) || found === undefined) return null;
  const places = placesOf(run);
  const operator = found[0]?.kind.startsWith("operator_") ?? false;
  const Icon = operator ? IconHandStop : IconAlertTriangle;
  const plain = run.ended_at === null || run.state === "stopped" || run.result === null;
  if (found.length === 0 && plain) return null;
  return (
    <section
      className={style.causes}
      aria-label="Why"
      data-known={found.length > 0 || undefined}
      data-operator={operator || undefined}
    >
      <h2>
        <Icon size={15} aria-hidden /> Why
      </h2>
      {found.length === 0 ? (
        <p>No cause is recorded.</p>
      ) : (
        <ol>
          {found.slice(0, SHOWN).map((cause) => (
            <Line
              key={`${cause.kind} ${cause.at} ${cause.text}`}
              cause={cause}
              inside={(places.get(cause.action ?? "")?.levels.length ?? 0) > 0}
              onShow={onShow}
            />
          ))}
        </ol>
      )}
      {found.length > SHOWN && <p>and {found.length - SHOWN} more, among the events</p>}
      <SinceWhenButton runner={runner} run={run} />
    </section>
  );
}
