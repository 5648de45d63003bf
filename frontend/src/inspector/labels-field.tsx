/** The labels of a graph, or of an action of the library. */
import { TagsInput } from "@mantine/core";
import { useEditorContext } from "../edit-actions/editor-context";
import { graphLabels, setLabels } from "./labels";

export function LabelsField() {
  const { doc, graph } = useEditorContext();
  return (
    <TagsInput
      label="Labels"
      size="sm"
      placeholder="night shift, demo …"
      maxTags={20}
      value={graphLabels(graph)}
      onChange={(labels) => setLabels(doc, labels)}
    />
  );
}
