/** Renders the canvas as an SVG or PNG file. */
import { svgPictureOf } from "../canvas/svg-picture";
import type { EditorContext } from "../edit-actions/editor-context";

const LARGEST = 8_000; // px of a PNG's longer side; browsers refuse much more

/** Return the picture as PNG with two pixels per px, or fewer where it would be too large. */
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

/** Return the picture of the canvas in the colours of the page. */
export async function graphPicture(context: EditorContext, format: "svg" | "png"): Promise<Blob> {
  const colors = getComputedStyle(document.documentElement);
  const picture = svgPictureOf(context.graph, context.positions(), context.sizes(), (token) =>
    colors.getPropertyValue(token).trim(),
  );
  const { svg, width, height } = picture;
  if (format === "svg") return new Blob([svg], { type: "image/svg+xml" });
  return rasterised(svg, width, height);
}
