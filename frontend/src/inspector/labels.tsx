/** The labels of a graph, or of an action of the library. */

import { TagsInput } from "@mantine/core";
import { useState } from "react";
import type * as Y from "yjs";
import { useEditorContext } from "../edit-actions/editor-context";
import { rootOf } from "../graph/document-keys";
import { asOneEdit } from "../graph/edit/document-writes";
import { memberText, withMember } from "../graph/json-members";
import type { Graph } from "../graph/model";
import { asJsonText } from "../graph/values";
import { usePendingText } from "../ui/drafts";

const KEY = "x/gui_attributes";

function attributes(text: string | undefined): string {
  return text?.trimStart().startsWith("{") ? text : "{}";
}

export function graphLabels(graph: Graph): string[] {
  const kept = graph.extra.find(([field]) => `x/${field}` === KEY)?.[1];
  const text = memberText(attributes(kept), "labels");
  const value: unknown = text === null ? [] : JSON.parse(text);
  return Array.isArray(value) ? value.filter((label) => typeof label === "string") : [];
}

/** Sets the labels; all other members of `gui_attributes` stay as they are spelled. */
export function setLabels(doc: Y.Doc, labels: readonly string[]): void {
  const kept = [...new Set(labels.map((label) => label.trim()).filter(Boolean))];
  const text = withMember(
    attributes(asJsonText(rootOf(doc, "meta").get(KEY))),
    "labels",
    kept.length === 0 ? null : JSON.stringify(kept),
  );
  asOneEdit(doc, () => {
    if (text === "{}") rootOf(doc, "meta").delete(KEY);
    else rootOf(doc, "meta").set(KEY, text);
  });
}

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
