/** Downloads a graph as UMRF, as the server writes it, or as a picture of the canvas. */
import { notifications } from "@mantine/notifications";
import { serverPath } from "../api/page-url";
import type { EditorContext, ExportFormat } from "../edit-actions/editor-context";

/** Return a file name that every file system accepts. */
function fileName(name: string): string {
  const plain = name
    .replace(/[^\p{L}\p{N} ._-]+/gu, "_")
    .replace(/^[._]+/, "")
    .trim();
  return plain.slice(0, 80) || "graph";
}

function save(href: string, name: string): void {
  const link = document.createElement("a");
  link.href = href;
  link.download = name;
  link.click();
}

function saveBlob(blob: Blob, name: string): void {
  const url = URL.createObjectURL(blob);
  save(url, name);
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Download the graph in a format; a failed picture is reported as a notification. */
export async function exportGraph(context: EditorContext, format: ExportFormat): Promise<void> {
  const name = fileName(context.graph.name);
  if (format === "umrf") {
    save(
      serverPath(`/api/graphs/${encodeURIComponent(context.id)}/umrf`),
      `${name}.umrf.graph.json`,
    );
    return;
  }
  try {
    const { graphPicture } = await import("../canvas/svg-picture");
    const picture = graphPicture(context.graph, context.positions(), context.sizes(), format);
    saveBlob(await picture, `${name}.${format}`);
  } catch (error) {
    const message = error instanceof Error ? error.message : String(error);
    notifications.show({ color: "red", title: "No picture made", message });
  }
}
