/** Opens menus, the command palette and dialogs over the editor, one at a time. */

import type { EditorContext, Overlay } from "../../edit-actions/editor-context";
import type { NewAction } from "../../graph/edit";
import { Later, lazyPart, OverlayBoundary, PartBoundary, useOnceIdle } from "../../ui/lazy-part";
import { TypingField } from "../../ui/typed-ahead";

const ArrowDialog = lazyPart(() => import("./arrow-dialog").then((part) => part.ArrowDialog));
const RetargetDialog = lazyPart(() => import("./arrow-dialog").then((part) => part.RetargetDialog));
const CommandPalette = lazyPart(() =>
  import("./command-palette").then((part) => part.CommandPalette),
);
const ContextMenu = lazyPart(() => import("./context-menu").then((part) => part.ContextMenu));
const RareOverlay = lazyPart(() => import("./rare-overlay").then((part) => part.RareOverlay));
const GraphPrint = lazyPart(() => import("./graph-print").then((part) => part.GraphPrint));

interface Props {
  /** The graph is on screen. */
  drawn: boolean;
  context: EditorContext;
  /** Actions that can be added. */
  known: readonly NewAction[];
  overlay: Overlay | null;
  onClose: () => void;
}

export function Overlays(props: Props) {
  // Loaded early: people may type right after the shortcut that opens them. The cards come before.
  useOnceIdle(props.drawn, () => {
    for (const part of [ArrowDialog, CommandPalette, ContextMenu]) void part.preload();
  });
  return (
    <>
      {/* Invisible until somebody prints: the browser prints the page as it is. */}
      <PartBoundary frame={() => null}>
        <Later drawn={props.drawn}>
          <GraphPrint context={props.context} />
        </Later>
      </PartBoundary>
      <OverlayBoundary>
        <OpenOverlay {...props} />
      </OverlayBoundary>
    </>
  );
}

function OpenOverlay({ context, known, overlay, onClose }: Props) {
  if (overlay === null) return null;
  switch (overlay.kind) {
    case "arrow":
      return (
        <PartBoundary waiting={<TypingField />}>
          <ArrowDialog
            context={context}
            known={known}
            from={overlay.from}
            to={overlay.to}
            onClose={onClose}
          />
        </PartBoundary>
      );
    case "retarget":
      return <RetargetDialog context={context} {...overlay} onClose={onClose} />;
    case "menu":
      return <ContextMenu context={context} screen={overlay.screen} onClose={onClose} />;
    case "palette":
      return (
        <PartBoundary waiting={<TypingField />}>
          <CommandPalette context={context} onClose={onClose} />
        </PartBoundary>
      );
    case "note": // edited on the canvas itself
    case "begin": // the page provides it, with the runs
      return null;
    default:
      return <RareOverlay context={context} overlay={overlay} onClose={onClose} />;
  }
}
