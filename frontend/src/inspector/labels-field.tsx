/** The labels of a graph, or of an action of the library. */
import { TagsInput } from "@mantine/core";
import { useState } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import { usePendingText } from "../ui/drafts/use-draft";
import { graphLabels, setLabels } from "./labels";

export function LabelsField() {
  const { doc, graph } = useEditorContext();
  const [typed, setTyped] = useState("");
  usePendingText(typed, () => {
    setLabels(doc, [...graphLabels(graph), typed.trim()]);
    setTyped("");
  });
  return (
    <TagsInput
      label="Labels"
      size="sm"
      placeholder="night shift, demo …"
      maxTags={20}
      value={graphLabels(graph)}
      searchValue={typed}
      onSearchChange={setTyped}
      onChange={(labels) => setLabels(doc, labels)}
    />
  );
}
