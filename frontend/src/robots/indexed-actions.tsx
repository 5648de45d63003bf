/** The actions and graphs that a robot has indexed. */
import { Text } from "@mantine/core";
import { useLive } from "../api/live/use-live";
import { useIndexedByRobot } from "../api/robots";
import { isolated } from "../words/isolated";
import style from "./indexed-actions.module.css";

function parameters(inputs: Record<string, string>): string {
  return Object.entries(inputs)
    .map(([name, type]) => `${isolated(name)}: ${type}`)
    .join(", ");
}

export function IndexedActions({ robot }: { robot: string }) {
  const { runner } = useLive();
  const known = useIndexedByRobot(runner, robot, true);
  if (known.isPending) return <Text c="dimmed">Reading …</Text>;
  if (known.isError) return <Text c="var(--error)">What it knows cannot be read now.</Text>;
  const { actions, graphs, unread } = known.data;
  return (
    <>
      {actions.length === 0 && <Text c="dimmed">It has named no actions.</Text>}
      <ul className={style.list}>
        {actions.map(({ name, inputs, outputs }) => (
          <li key={name}>
            <b>{name}</b> <span className={style.quiet}>({parameters(inputs)})</span>
            {Object.keys(outputs).length > 0 && (
              <span className={style.quiet}> → {parameters(outputs)}</span>
            )}
          </li>
        ))}
      </ul>
      {graphs.length > 0 && (
        <p className={style.graphs}>
          Graphs of its own: <b>{graphs.map(isolated).join(", ")}</b>
        </p>
      )}
      {unread > 0 && <Text c="var(--warn)">{unread} of its files cannot be read.</Text>}
    </>
  );
}
