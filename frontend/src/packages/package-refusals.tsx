/** Actions that have no package, why, and the way to each of them. */
import { Button } from "@mantine/core";
import type { PackageRefusal } from "../api/packages";
import type { EditorContext } from "../edit-actions/editor-context";
import style from "./packages.module.css";

interface Props {
  refusals: readonly PackageRefusal[];
  context: EditorContext;
  onClose: () => void;
}

export function PackageRefusals({ refusals, context, onClose }: Props) {
  if (refusals.length === 0) return null;
  const show = (name: string) => {
    const keys = context.graph.actions
      .filter((action) => action.name === name && !action.missing)
      .map((action) => action.key);
    onClose();
    context.select(keys);
    context.view.show(keys);
  };
  return (
    <section aria-label="Without a package" className={style.refusals}>
      <h3>
        {refusals.length === 1
          ? "One thing stands against a package"
          : `${refusals.length} things stand against packages`}
      </h3>
      <ul>
        {refusals.map(({ action, place, reason }) => (
          <li key={`${place} ${reason}`}>
            <span>
              <bdi className={style.place}>{place || "an action without a name"}</bdi> {reason}
            </span>
            <Button variant="default" size="compact-sm" onClick={() => show(action)}>
              Show<span className="visually-hidden"> {action || "it"}</span>
            </Button>
          </li>
        ))}
      </ul>
    </section>
  );
}
