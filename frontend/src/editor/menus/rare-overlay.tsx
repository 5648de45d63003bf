/** The dialogs over the editor that are seldom opened: nobody loads even their names before. */
import type { EditorContext, Overlay } from "../../edit-actions/editor-context";
import { lazyPart } from "../../ui/lazy-part";

const FlatDialog = lazyPart(() =>
  import("../../levels/flat-dialog").then((part) => part.FlatDialog),
);
const ExtractDialog = lazyPart(() =>
  import("../../levels/sub-graph-dialogs").then((part) => part.ExtractDialog),
);
const UnpackDialog = lazyPart(() =>
  import("../../levels/sub-graph-dialogs").then((part) => part.UnpackDialog),
);
const TriesDialog = lazyPart(() => import("./tries-dialog").then((part) => part.TriesDialog));
const CopiesDialog = lazyPart(() => import("./copies-dialog").then((part) => part.CopiesDialog));
const RenamedUses = lazyPart(() =>
  import("../../canvas/renamed-uses").then((part) => part.RenamedUses),
);
const PackagesDialog = lazyPart(() =>
  import("../../packages/packages-dialog").then((part) => part.PackagesDialog),
);
const ShortcutSheet = lazyPart(() => import("./shortcut-sheet").then((part) => part.ShortcutSheet));

type Rare = Exclude<
  Overlay,
  { readonly kind: "arrow" | "retarget" | "menu" | "palette" | "note" | "begin" }
>;

interface Props {
  context: EditorContext;
  overlay: Rare;
  onClose: () => void;
}

export function RareOverlay({ context, overlay, onClose }: Props) {
  switch (overlay.kind) {
    case "packages":
      return <PackagesDialog context={context} {...overlay} onClose={onClose} />;
    case "flat":
      return <FlatDialog context={context} onClose={onClose} />;
    case "extract":
      return <ExtractDialog context={context} {...overlay} onClose={onClose} />;
    case "unpack":
      return <UnpackDialog context={context} {...overlay} onClose={onClose} />;
    case "tries":
      return <TriesDialog context={context} {...overlay} onClose={onClose} />;
    case "copies":
      return <CopiesDialog context={context} {...overlay} onClose={onClose} />;
    case "renamed": {
      const uses = overlay.uses.map((id) => ({
        id,
        name: context.store.graphsInside.now()?.names.get(id) ?? "",
      }));
      return <RenamedUses graph={context.id} {...overlay} uses={uses} onClose={onClose} />;
    }
    case "keys":
      return <ShortcutSheet onClose={onClose} />;
  }
}
