/** Taking a graph away as a file: UMRF as the server writes it, or a picture of the canvas. */
import { notifications } from "@mantine/notifications";
import { serverPath } from "../api/page-url";
import type { EditorContext, ExportFormat } from "../edit-actions/editor-context";

const LARGEST = 8_000; // px of a PNG's longer side; browsers refuse much more

/** A name that every file system takes. */
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

/** The picture as PNG, twice as fine as on screen where that is not too large. */
async function rasterised(svg: string, width: number, height: number): Promise<Blob> {
  const scale = Math.min(2, LARGEST / Math.max(width, height));
  const image = new Image();
  const url = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
  try {
    image.src = url;
    await image.decode();
    const canvas = document.createElement("canvas");
    canvas.width = Math.ceil(width * scale);
    canvas.height = Math.ceil(height * scale);
    canvas.getContext("2d")?.drawImage(image, 0, 0, canvas.width, canvas.height);
    return await new Promise((done, fail) =>
      canvas.toBlob(
        (blob) => (blob ? done(blob) : fail(new Error("The picture is too large."))),
        "image/png",
      ),
    );
  } finally {
    URL.revokeObjectURL(url);
  }
}

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
    const { svgPictureOf } = await import("../canvas/svg-picture");
    const colors = getComputedStyle(document.documentElement);
    const picture = svgPictureOf(context.graph, context.positions(), context.sizes(), (token) =>
      colors.getPropertyValue(token).trim(),
    );
    const { svg, width, height } = picture;
    if (format === "svg") saveBlob(new Blob([svg], { type: "image/svg+xml" }), `${name}.svg`);
    else saveBlob(await rasterised(svg, width, height), `${name}.png`);
  } catch (error) {
    const message = error instanceof Error ? error.message : String(error);
    notifications.show({ color: "red", title: "No picture made", message });
  }
}
