/** Dry-run, in words and beside Start: it is what comes before. */
import { Button } from "@mantine/core";
import { dryRun } from "../../edit-actions/dry-run-actions";
import { isEnabled } from "../../edit-actions/edit-action";
import { useEditorContext } from "../../edit-actions/editor-context";
import style from "./dry-run-button.module.css";

/** `stacked`: its sign over its word, where there is little room. */
export function DryRunButton({ stacked = false }: { stacked?: boolean }) {
  const context = useEditorContext();
  const Sign = dryRun.icon;
  return (
    <Button
      className={style.dry ?? ""}
      data-stacked={stacked || undefined}
      leftSection={<Sign size={stacked ? 20 : 16} aria-hidden />}
      aria-pressed={context.dryRun !== null}
      data-pressed={context.dryRun !== null || undefined}
      disabled={!isEnabled(dryRun, context)}
      title="Play the graph on the canvas, by the engine’s rules; nothing moves"
      onClick={() => dryRun.run(context)}
    >
      {dryRun.label}
    </Button>
  );
}
