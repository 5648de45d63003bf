/** The context of the editor, and where the links of its notes lead: to the action, chosen and shown. */
import { type ReactNode, useMemo } from "react";
import { type NoteLinks, NoteLinksContext } from "../../canvas/notes/action-link";
import { type EditorContext, EditorReactContext } from "../../edit-actions/editor-context";
import { linkedAction } from "../../graph/note-links";

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
    }),
    [graph.actions, select, view],
  );
  return (
    <EditorReactContext value={context}>
      <NoteLinksContext value={links}>{children}</NoteLinksContext>
    </EditorReactContext>
  );
}
