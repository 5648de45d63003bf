/** The graph on paper: black on white, with its name, version, digest and the day. */

import { useVersions, versionName } from "../../api/graphs";
import { type PrintPages, pagesOf } from "../../canvas/views/print-pages";
import { svgPictureOf } from "../../canvas/views/svg-picture";
import { serverNow } from "../../clock/server-clock";
import type { EditorContext } from "../../edit-actions/editor-context";
import { useThrottledLink } from "../../sync/use-room";
import { PrintSheet } from "../../ui/print-sheet";
import { clock, dateText } from "../../ui/times";
import style from "./graph-print.module.css";

const WHITE = new Set(["--canvas", "--raised", "--panel", "--bg"]);
/** Outcomes are told by their signs and words, robots by their names. */
const ink = (token: string) =>
  WHITE.has(token) ? "#ffffff" : token === "--line2" ? "#444444" : "#000000";

/** The picture as elements: an image of its own would come too late, and without the fonts of the page. */
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
