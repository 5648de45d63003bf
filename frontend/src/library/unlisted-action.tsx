/** Shows an action that is not in the library, as graphs or robots have it, with a button to add it. */
import { Button } from "@mantine/core";
import { IconPlus } from "@tabler/icons-react";
import { useMay } from "../api/people";
import { type RobotAction, type RobotsKnowledge, robotTemplate } from "../home/robot-actions";
import { ActionOverview, OnRobots, UsedIn } from "./action-overview";
import type { ListedAction } from "./listing";
import style from "./open-action.module.css";

interface Props {
  listed: ListedAction;
  knowledge: RobotsKnowledge;
  busy: boolean;
  /** Adds it to the library as graphs have it. */
  onAdd: (name: string) => void;
  /** Adds it to the library as a robot has it. */
  onTake: (has: RobotAction) => void;
}

/** Return the parts of an action: those in graphs, else those of the first robot. */
function partsOf({ action, robots: [first] }: ListedAction) {
  const template = first && robotTemplate(first.action);
  return {
    description: action?.description ?? "",
    type: action?.type ?? "sync",
    labels: [],
    inputs: action?.inputs ?? template?.inputs ?? [],
    outputs: action?.outputs ?? template?.outputs ?? [],
  };
}

export function UnlistedAction({ listed, knowledge, busy, onAdd, onTake }: Props) {
  const { name, action } = listed;
  const mayEdit = useMay("edit");
  const takeOver = (has: RobotAction) =>
    mayEdit && (
      <Button size="compact-sm" variant="subtle" disabled={busy} onClick={() => onTake(has)}>
        Take over
        <span className="visually-hidden">
          {" "}
          from <bdi>{has.robot}</bdi>
        </span>
      </Button>
    );
  return (
    <section className={style.middle} aria-label={name}>
      <div className={style.inner}>
        <div className={style.head}>
          <h2 className={style.title}>
            <bdi>{name}</bdi>
          </h2>
          {mayEdit && action !== null && (
            <Button
              variant="filled"
              className={style.tool ?? ""}
              loading={busy}
              leftSection={<IconPlus size={16} aria-hidden />}
              onClick={() => onAdd(name)}
            >
              Add to the library
            </Button>
          )}
        </div>
        <p className={style.names}>
          {action === null
            ? "The library does not have it, and no graph uses it."
            : "Not in the library: each graph describes its parameters separately. In the library, they are described once."}
        </p>
        <ActionOverview {...partsOf(listed)}>
          {action && <UsedIn usedIn={action.used_in} differs={[]} />}
          <OnRobots name={name} knowledge={knowledge} own={action} offer={takeOver} />
        </ActionOverview>
      </div>
    </section>
  );
}
