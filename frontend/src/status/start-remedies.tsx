/** The buttons beside a look before a start for what it lacks: the baton, a confirmation. */
import { Button } from "@mantine/core";
import { IconUserCheck } from "@tabler/icons-react";
import { unconfirmed } from "../api/http";
import { useLive } from "../api/page-link";
import { useRight } from "../api/rights";
import type { Preflight } from "../api/robots";
import { TakeBaton } from "./robot-rights";
import style from "./start-remedies.module.css";

/** Return the robots that ask this person to confirm who they are. */
export function askingRobots(looks: readonly Preflight[] | undefined): string[] {
  const asks = ({ items }: Preflight) =>
    items.some(({ code, verdict }) => code === "confirm" && verdict === "blocked");
  return (looks ?? []).filter(asks).map(({ engine }) => engine);
}

/** Offers to confirm who one is, before anything is held; whatever shows it stays as it is. */
export function ConfirmFirst({ looks }: { looks: readonly Preflight[] | undefined }) {
  const robots = askingRobots(looks);
  if (robots.length === 0) return null;
  return (
    <section className={style.second} aria-label="Confirm that it is you">
      <Button
        size="compact-sm"
        leftSection={<IconUserCheck size={14} aria-hidden />}
        onClick={() => unconfirmed.set(robots)}
      >
        Confirm that it is you …
      </Button>
    </section>
  );
}

/** Offers the baton of a robot that it would need. */
export function BatonRemedy({ engine, onTaken }: { engine: string; onTaken: () => void }) {
  const { now } = useLive();
  const robot = now.engines.find(({ name }) => name === engine);
  const mayTake = useRight(engine)?.may_take ?? false;
  if (robot === undefined || !mayTake) return null;
  return (
    <span className={style.remedies}>
      <TakeBaton robot={robot} onTaken={onTaken} />
    </span>
  );
}
