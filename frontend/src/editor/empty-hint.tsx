/** Says on a canvas without actions how one draws the first. */
import { Button, Kbd } from "@mantine/core";
import { IconRouteAltLeft } from "@tabler/icons-react";
import type { EditorContext } from "../edit-actions/editor-context";
import { Empty } from "../ui/empty";
import { useHasFingersOnly } from "../ui/hooks";
import style from "./canvas-pane.module.css";

export function EmptyHint({ context }: { context: EditorContext }) {
  const fingers = useHasFingersOnly();
  if (!context.mayEdit) {
    return (
      <div className={style.empty}>
        <Empty icon={<IconRouteAltLeft size={22} />} title="Nothing is drawn yet">
          What others draw appears here. You can view this graph, not change it.
        </Empty>
      </div>
    );
  }
  return (
    <div className={style.empty}>
      <Empty
        icon={<IconRouteAltLeft size={22} />}
        title="What shall be done first?"
        action={
          <Button variant="filled" onClick={() => context.openAdd()}>
            Add an action
          </Button>
        }
      >
        {fingers
          ? "Tap Add and type a name. Then tap an outcome of its card and the action that follows."
          : "Double-click the canvas, or drag an action from the list. Then drag from an outcome to the action that follows."}
        {!fingers && (
          <>
            {" "}
            By keyboard: <Kbd>A</Kbd> adds, <Kbd>C</Kbd> draws an arrow.
          </>
        )}
      </Empty>
    </div>
  );
}
