/** Prints a graph in black on white, on one page or several, with its name, version, digest and date. */
import { useVersions, versionName } from "../../api/graphs";
import { svgPictureOf } from "../../canvas/svg-picture";
import { serverNow } from "../../clock/server-clock";
import type { EditorContext } from "../../edit-actions/editor-context";
import { useThrottledLink } from "../../sync/use-room";
import { PrintSheet } from "../../ui/print-sheet";
import { clock, dateText } from "../../ui/times";
import style from "./graph-print.module.css";

interface PageView {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** Free space on an A4 page below the header, px of 1/96 inch. */
const ACROSS = { width: 1040, height: 600 };
const UPRIGHT = { width: 700, height: 900 };
/** Least scale: names have 13 px in the picture and must not be smaller than 5.4 pt on paper. */
const SMALLEST = 0.55;
const OVERLAP = 60; // px of the picture that neighbouring pages share
const MOST_PAGES = 40;

interface PrintPages {
  /** Parts of the picture, row by row. */
  readonly pages: readonly PageView[];
  /** The common scale of all pages. */
  readonly scale: number;
  /** True if the paper is in landscape format; portrait is chosen only if it shows the picture larger. */
  readonly across: boolean;
}

/** Divide a picture into pages: one if its names stay readable, else several. */
export function pagesOf(width: number, height: number): PrintPages {
  const scaleOn = (paper: typeof ACROSS) => Math.min(1, paper.width / width, paper.height / height);
  const across = scaleOn(ACROSS) >= scaleOn(UPRIGHT);
  const paper = across ? ACROSS : UPRIGHT;
  const whole = scaleOn(paper);
  if (whole >= SMALLEST) return { pages: [{ x: 0, y: 0, width, height }], scale: whole, across };
  for (let scale = SMALLEST; ; scale *= 0.9) {
    const [wide, high] = [paper.width / scale, paper.height / scale];
    const columns = count(width, wide);
    const rows = count(height, high);
    if (columns * rows > MOST_PAGES) continue;
    const pages = Array.from({ length: columns * rows }, (_, i) => ({
      x: (i % columns) * (wide - OVERLAP),
      y: Math.floor(i / columns) * (high - OVERLAP),
      width: wide,
      height: high,
    }));
    return { pages, scale, across };
  }
}

/** Return the number of overlapping pages that cover a length. */
function count(length: number, page: number): number {
  return Math.max(1, Math.ceil((length - OVERLAP) / (page - OVERLAP)));
}

const WHITE = new Set(["--canvas", "--raised", "--panel", "--bg"]);
/** Outcomes are shown by signs and words, robots by names, so that no colour is needed. */
const ink = (token: string) =>
  WHITE.has(token) ? "#ffffff" : token === "--line2" ? "#444444" : "#000000";

/** Renders the picture as SVG elements of the page: an image would load too late, and lack the fonts. */
function Picture({ svg, pages }: { svg: string; pages: PrintPages }) {
  return pages.pages.map(({ x, y, width, height }, i) => (
    <figure
      key={`${x} ${y}`}
      className={style.page}
      ref={(figure) => {
        const parsed = new DOMParser().parseFromString(svg, "image/svg+xml").documentElement;
        const [left = 0, top = 0] = (parsed.getAttribute("viewBox") ?? "").split(" ").map(Number);
        parsed.setAttribute("viewBox", `${left + x} ${top + y} ${width} ${height}`);
        parsed.setAttribute("width", String(width * pages.scale));
        parsed.setAttribute("height", String(height * pages.scale));
        figure?.querySelector("svg")?.remove();
        figure?.prepend(document.importNode(parsed, true));
      }}
    >
      {pages.pages.length > 1 && (
        <figcaption>
          Page {i + 1} of {pages.pages.length}
        </figcaption>
      )}
    </figure>
  ));
}

export function GraphPrint({ context }: { context: EditorContext }) {
  const { id, graph } = context;
  const versions = useVersions(id).data;
  const { seq, unsaved } = useThrottledLink();
  const version = unsaved === 0 ? versions?.find((each) => each.seq === seq) : undefined;
  const newest = versions?.[0];
  const now = serverNow();
  const content = () => {
    const { svg, width, height } = svgPictureOf(graph, context.positions(), context.sizes(), ink);
    const pages = pagesOf(width, height);
    return { across: pages.across, body: <Picture svg={svg} pages={pages} /> };
  };
  const what = version
    ? versionName(versions, version.id)
    : `moment ${seq}${unsaved > 0 ? " and edits that are not saved yet" : ""}${
        newest ? `, after ${versionName(versions, newest.id)}` : ", never published"
      }`;
  return (
    <PrintSheet
      title={graph.name || "Untitled"}
      facts={[
        ["Version", what],
        ["Digest", version?.digest ?? "none: only versions have one"],
        ["Actions", String(graph.actions.length)],
        ["Printed", `${dateText(now)} ${clock(now)}`],
      ]}
      content={content}
    />
  );
}
