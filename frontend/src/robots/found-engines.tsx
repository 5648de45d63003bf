/** Engines that were found and that nobody registered: one tap registers them. */
import { Button } from "@mantine/core";
import { IconRadar2 } from "@tabler/icons-react";
import { useLive } from "../api/live/use-live";
import { type FoundEngine, useFoundEngines } from "../api/robots";
import style from "./found-engines.module.css";

interface Props {
  may: boolean;
  on: boolean;
  onTake: (candidate: FoundEngine) => void;
}

function words(candidate: FoundEngine): string {
  if (candidate.problem !== "") return candidate.problem;
  if (candidate.generation === "older") return "speaks an older generation of messages";
  if (candidate.actor === "") return "an idle engine does not say its name: you have to know it";
  return "heard by its feedback";
}

export function FoundEngines({ may, on, onTake }: Props) {
  const { runner } = useLive();
  const { data } = useFoundEngines(runner, on);
  const found = data?.engines ?? [];
  const looking = (data?.left_s ?? 0) > 0;
  if (found.length === 0 && !looking) return null;
  return (
    <section className={style.section} aria-label="In sight, not registered">
      <h3 className={style.title}>
        <IconRadar2 size={16} aria-hidden /> In sight, not registered
      </h3>
      {looking && (
        <p className={style.quiet} role="status">
          Looking for engines; others may still come into sight for {Math.ceil(data?.left_s ?? 0)}{" "}
          s.
        </p>
      )}
      <ul className={style.list}>
        {found.map((each) => (
          <li key={`${each.domain} ${each.get_service}`} className={style.line}>
            <b>{each.actor || "An engine"}</b>
            <span className={style.quiet}>
              domain {each.domain} · {each.get_service} · {words(each)}
            </span>
            <span className={style.gap} />
            <Button size="compact-sm" disabled={!may} onClick={() => onTake(each)}>
              Register{each.actor === "" ? " …" : ""}
            </Button>
          </li>
        ))}
      </ul>
    </section>
  );
}
