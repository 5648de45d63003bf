/** What can be made of the moment that is looked at: the graph again, or another one. */
import { Button } from "@mantine/core";
import { IconCopyPlus, IconRestore } from "@tabler/icons-react";
import type { Version } from "../../api/graphs";
import { useEditorContext } from "../../edit-actions/editor-context";
import { useThrottledLink } from "../../sync/use-room";
import { isolated } from "../../words/isolated";
import { useGoingBack } from "./going-back";
import style from "./past-ways.module.css";
import { useCopyAsGraph } from "./use-copies";

export function PastWays({ versions }: { versions: readonly Version[] }) {
  const context = useEditorContext();
  const { past, mayGoBack } = context;
  const { seq } = useThrottledLink();
  const { busy, restore } = useGoingBack(context);
  const copies = useCopyAsGraph();
  if (past === null || !mayGoBack) return null;
  const { at } = past;
  const index = versions.findIndex((each) => each.seq === at);
  const called = index < 0 ? `change ${at}` : `v${versions.length - index}`;
  return (
    <div className={style.ways}>
      {at < seq && (
        <Button
          fullWidth
          variant="default"
          loading={busy}
          leftSection={<IconRestore size={15} aria-hidden />}
          onClick={() => void restore(at)}
        >
          Make the graph so again
        </Button>
      )}
      <Button
        fullWidth
        variant="default"
        loading={copies.busy}
        leftSection={<IconCopyPlus size={15} aria-hidden />}
        onClick={() => void copies.copy(at, called)}
      >
        Copy {isolated(called)} as a new graph
      </Button>
      <p>To go back is an edit like any other: nothing is lost, and it can be undone.</p>
    </div>
  );
}
