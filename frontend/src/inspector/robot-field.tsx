/** The field for the robot of one action, or of several at once. */
import { Button } from "@mantine/core";
import { useLive } from "../api/page-link";
import { useEditorContext } from "../edit-actions/editor-context";
import { asOneEdit, setField } from "../graph/edit";
import type { Action } from "../graph/model";
import { robotNames } from "../graph/robots";
import { DraftChoice } from "../ui/draft-input";
import { colorOfName } from "../ui/name-colors";
import style from "./inspector.module.css";

/** Return the names to choose from: robots of the graph first, then those that are registered. */
export function suggestedRobots(
  actions: readonly Action[],
  engines: readonly { readonly name: string; readonly simulated: boolean }[],
): string[] {
  const registered = engines.flatMap(({ name, simulated }) => (simulated ? [] : [name])).sort();
  return [...new Set([...robotNames(actions), ...registered])];
}

export function RobotField({ actions }: { actions: readonly Action[] }) {
  const { doc, graph, mayEdit } = useEditorContext();
  const { now } = useLive();
  const [first = "", ...others] = new Set(actions.map(({ actor }) => actor));
  const differ = others.length > 0;
  const names = robotNames(actions);
  const write = (robot: string) =>
    asOneEdit(doc, () =>
      actions.map(({ key }) => setField(doc, key, "actor", robot)).some((found) => found),
    );
  return (
    <div data-robot-field>
      <DraftChoice
        label={actions.length > 1 ? `Robot of these ${actions.length} actions` : "Robot"}
        placeholder={differ ? names.join(", ") : "any robot"}
        data={suggestedRobots(graph.actions, now.engines)}
        value={differ ? "" : first}
        leftSection={
          <i
            className={style.robot}
            style={{ background: colorOfName(differ ? "" : first) }}
            aria-hidden
          />
        }
        onCommit={(robot) => write(robot.trim())}
      />
      {differ && mayEdit && (
        <Button size="compact-xs" variant="subtle" mt={4} onClick={() => write("")}>
          Any robot
        </Button>
      )}
    </div>
  );
}

/** The details of several selected things: what can be set for all of the actions among them. */
export function SeveralForm({ actions }: { actions: readonly Action[] }) {
  const own = actions.filter(({ missing }) => !missing);
  if (own.length === 0) return null;
  return (
    <div className={style.form} data-form="several" style={{ marginTop: "0.75rem" }}>
      <RobotField key={own.map(({ key }) => key).join(" ")} actions={own} />
    </div>
  );
}
