/** What opens over the editor, one at a time: menus, the palette, dialogs of single deeds. */

import type { EditorContext, Overlay } from "../../edit-actions/editor-context";
import { ArrowDialog, RetargetDialog } from "./arrow-dialog";
import { Palette } from "./command-palette";
import { ContextMenu } from "./context-menu";
import { KeysSheet } from "./shortcut-sheet";

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
      return <Palette context={context} onClose={onClose} />;
    case "keys":
      return <KeysSheet onClose={onClose} />;
    case "note":
      return null; // written on the canvas
  }
}
