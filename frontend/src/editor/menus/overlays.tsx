/** What opens over the editor, one at a time: menus, the palette, dialogs of single deeds. */

import type { Bench, Surface } from "../../edit-actions/editor-context";
import { ArrowDialog, RetargetDialog } from "./arrow-dialog";
import { Palette } from "./command-palette";
import { ContextMenu } from "./context-menu";
import { KeysSheet } from "./shortcut-sheet";

interface Props {
  bench: Bench;
  surface: Surface | null;
  onClose: () => void;
}

export function Surfaces({ bench, surface, onClose }: Props) {
  if (surface === null) return null;
  switch (surface.kind) {
    case "arrow":
      return <ArrowDialog bench={bench} from={surface.from} to={surface.to} onClose={onClose} />;
    case "retarget":
      return <RetargetDialog bench={bench} relation={surface.relation} onClose={onClose} />;
    case "menu":
      return <ContextMenu bench={bench} screen={surface.screen} onClose={onClose} />;
    case "palette":
      return <Palette bench={bench} onClose={onClose} />;
    case "keys":
      return <KeysSheet onClose={onClose} />;
    case "note":
      return null; // written on the canvas
  }
}
