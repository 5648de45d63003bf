/** Fields that the form of an action has, in a graph and in the library. */
import type { ReactNode } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import { setField } from "../../graph/edit";
import type { Action } from "../../graph/model";
import { DraftInput } from "../../ui/draft-input";
import { SharedField } from "./shared-field";

interface Props {
  action: Action;
}

interface NameProps extends Props {
  description?: ReactNode;
  onRename: (name: string) => boolean;
}

export function NameField({ action, description, onRename }: NameProps) {
  return (
    <SharedField of={action.key} field="name">
      <DraftInput
        label="Name"
        value={action.name}
        check={(draft) => (draft.trim() === "" ? "Enter a name for the action." : null)}
        onCommit={(name) => onRename(name.trim())}
      />
      {description}
    </SharedField>
  );
}

export function DescriptionField({ action }: Props) {
  const { doc } = useEditorContext();
  return (
    <SharedField of={action.key} field="description">
      <DraftInput
        label="Description"
        lines
        value={action.description}
        placeholder="What it does, for people"
        onCommit={(text) => setField(doc, action.key, "description", text)}
      />
    </SharedField>
  );
}

export function TypeField({ action }: Props) {
  const { doc } = useEditorContext();
  return (
    <SharedField of={action.key} field="type">
      <DraftInput
        label="Type"
        value={action.type}
        description="sync and async behave alike; spontaneous may report again and again"
        check={(draft) => (draft.trim() === "" ? "The engine needs a type, usually sync." : null)}
        onCommit={(text) => setField(doc, action.key, "type", text.trim())}
      />
    </SharedField>
  );
}
