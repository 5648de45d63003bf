/** What opens over the editor, one at a time: menus, the palette, dialogs of single edit actions. */

import type { EditorContext, Overlay } from "../../edit-actions/editor-context";
import { ArrowDialog, RetargetDialog } from "./arrow-dialog";
import { CommandPalette } from "./command-palette";
import { ContextMenu } from "./context-menu";
import { ShortcutSheet } from "./shortcut-sheet";

interface Props {
  context: EditorContext;
  overlay: Overlay | null;
  onClose: () => void;
}

export function Overlays({ context, overlay, onClose }: Props) {
  if (overlay === null) return null;
  switch (overlay.kind) {
    case "arrow":
      return (
        <ArrowDialog context={context} from={overlay.from} to={overlay.to} onClose={onClose} />
      );
    case "retarget":
      return <RetargetDialog context={context} relation={overlay.relation} onClose={onClose} />;
    case "menu":
      return <ContextMenu context={context} screen={overlay.screen} onClose={onClose} />;
    case "palette":
      return <CommandPalette context={context} onClose={onClose} />;
    case "keys":
      return <ShortcutSheet onClose={onClose} />;
    case "note":
      return null; // written on the canvas
  }
}
