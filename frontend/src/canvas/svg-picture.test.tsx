// @vitest-environment jsdom
import fc from "fast-check";
import { expect, test } from "vitest";
import * as Y from "yjs";
import { mapsOf } from "../graph/document-keys";
import { addAction, connect, setEntry, setExit } from "../graph/edit";
import { writeNote } from "../graph/edit/notes";
import { setWaypoints } from "../graph/edit/waypoints";
import { readGraph } from "../graph/read";
import { positionsOf } from "./geometry/arrange";
import { svgPictureOf } from "./svg-picture";

function drawn(name: string, robot: string, text: string, other = "") {
  const doc = new Y.Doc();
  const a = addAction(doc, {
    name,
    actor: robot,
    inputs: [{ path: "x", text: JSON.stringify({ pvf_type: "string", pvf_value: text }) }],
  });
  const b = addAction(doc, { name: "Next", actor: other });
  setEntry(doc, a);
  connect(doc, a, b, "on_error");
  setExit(doc, b);
  writeNote(doc, { kind: "note", at: [0, 0], size: [160, 60], text, color: "red" });
  const graph = readGraph(mapsOf(doc));
  return svgPictureOf(
    graph,
    positionsOf(graph),
    new Map(),
    (token) => `#${token.length}${token.length}0`,
  );
}

test("for any texts the picture is well-formed and contains no script", () => {
  const hostile = fc.oneof(
    fc.string({ unit: "binary" }),
    fc.constantFrom(
      "<script>alert(1)</script>",
      '"><image href="x" onerror="y"/>',
      "]]>",
      "&amp;",
      "\0\u{FFFE}",
    ),
  );
  fc.assert(
    fc.property(hostile, hostile, hostile, (name, robot, text) => {
      const { svg } = drawn(name, robot, text, "Scout");
      const parsed = new DOMParser().parseFromString(svg, "image/svg+xml");
      expect(parsed.querySelector("parsererror")).toBeNull();
      const kinds = new Set([...parsed.querySelectorAll("*")].map(({ tagName }) => tagName));
      // Those of the mark between two robots.
      for (const kind of ["g", "title"]) kinds.delete(kind);
      expect([...kinds].sort()).toEqual(["circle", "path", "rect", "svg", "text", "tspan"]);
    }),
    { numRuns: 20 },
  );
});

test("a picture has every card, end, arrow and note within its bounds", () => {
  const { svg, width, height } = drawn("Look", "atlas", "mind the step", "Scout");
  const parsed = new DOMParser().parseFromString(svg, "image/svg+xml");
  const words = [...parsed.querySelectorAll("text")].map((each) => each.textContent);
  for (const word of ["Look", "Next", "atlas", "Entry", "Exit", "mind the step"]) {
    expect(words).toContain(word);
  }
  const [x0 = 0, y0 = 0] = (parsed.documentElement.getAttribute("viewBox") ?? "")
    .split(" ")
    .map(Number);
  for (const rect of parsed.querySelectorAll("rect")) {
    const [x, y] = [Number(rect.getAttribute("x")), Number(rect.getAttribute("y"))];
    expect(x >= x0 && x <= x0 + width && y >= y0 && y <= y0 + height).toBe(true);
  }
});

test("the picture has the waypoints of bent lines", () => {
  const doc = new Y.Doc();
  const [a, b] = ["A", "B"].map((name, i) => addAction(doc, { name, position: [i * 480, 0] }));
  const id = connect(doc, a ?? "", b ?? "") ?? "";
  const picture = () => {
    const graph = readGraph(mapsOf(doc));
    return svgPictureOf(graph, positionsOf(graph), new Map(), () => "#000");
  };
  const before = picture();
  setWaypoints(doc, `${id}|run`, [[360, -300]]);
  expect(picture().height).toBeGreaterThan(before.height + 150);
});

test("the picture names the robots of a graph that has several, and says which one waits", () => {
  const { svg } = drawn("DriveTo", "Carrier", "", "Scout");
  expect(svg).toContain(">Carrier</text>");
  expect(svg).toContain(">Scout</text>");
  expect(svg).toContain("<title>Scout waits for Carrier</title>");
  expect(drawn("DriveTo", "Carrier", "").svg).not.toContain("Carrier");
});
