/** The context of the editor; where the links of its notes lead, and how its frames are folded. */
import { type ReactNode, useMemo } from "react";
import {
  FoldFrameContext,
  type NoteLinks,
  NoteLinksContext,
} from "../../canvas/notes/note-buttons";
import { type EditorContext, EditorReactContext } from "../../edit-actions/editor-context";
import { foldFrames } from "../../edit-actions/folding";
import { linkableNames, linkedAction } from "../../graph/note-links";
import { useStableCallback } from "../../ui/hooks/use-stable-callback";

interface Props {
  context: EditorContext;
  children: ReactNode;
}

export function EditorContextProvider({ context, children }: Props) {
  const { graph, select, view } = context;
  const links = useMemo<NoteLinks>(
    () => ({
      target(link) {
        const action = linkedAction(graph.actions, link);
        return action && { key: action.key, label: `${action.name} ${action.instanceId}` };
      },
      open(key) {
        select([key]);
        view.show([key]);
        view.focus(key);
      },
      names: () => linkableNames(graph.actions),
    }),
    [graph.actions, select, view],
  );
  const fold = useStableCallback((key: string, folded: boolean) =>
    foldFrames(context, [key], folded),
  );
  return (
    <EditorReactContext value={context}>
      <NoteLinksContext value={links}>
        <FoldFrameContext value={fold}>{children}</FoldFrameContext>
      </NoteLinksContext>
    </EditorReactContext>
  );
}
