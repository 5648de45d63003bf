/** Draws a graph as one SVG or PNG picture from the same elements as the canvas. */

import { type Note, notesOf } from "../graph/edit/notes";
import type { Direction, Graph, Key, Position, Precondition } from "../graph/model";
import { spokenNote } from "../graph/note-links";
import { cardRows } from "../graph/parameters/card-rows";
import { shownName } from "../graph/questions";
import { type HandOver, handOverLabel, robotNames, robotOf } from "../graph/robots";
import { colorsAmong, firstLetter } from "../ui/name-colors";
import { type Bundle, bundlesOf, type HandOvers, handOversIn, pillWord } from "./arrows/bundles";
import { pathOf } from "./arrows/line-path";
import { routed } from "./arrows/routes";
import type { PillSize, Scene } from "./arrows/scene";
import type { LineMap, RoutedLine } from "./arrows/simple-lines";
import { type CanvasNode, nodesOf, sceneOf } from "./elements";
import { CARD_LINES } from "./geometry/arrange";
import { CARD, pillSize, type Sizes } from "./geometry/ranks";
import { NO_PROBLEM_MARKS } from "./marks/problem-marks";
import { noteColor } from "./notes/note-nodes";
import { OUTCOMES, outcomeColor } from "./outcome";

export interface SvgPicture {
  readonly svg: string;
  readonly width: number;
  readonly height: number;
}

const MARGIN = 36; // px
const HAND_WIDTH = 37; // px of the mark of an arrow between two robots
const FONT = "Inter, system-ui, sans-serif";
const MONO = "ui-monospace, monospace";

/** Escape a text for XML; characters that XML cannot hold are dropped. */
function escaped(text: string): string {
  return text
    .replace(/[^\t\n\r\u0020-\uD7FF\uE000-\uFFFD\u{10000}-\u{10FFFF}]/gu, "")
    .replaceAll("&", "&amp;")
    .replaceAll("<", "&lt;")
    .replaceAll(">", "&gt;")
    .replaceAll('"', "&quot;")
    .replaceAll("'", "&#39;");
}

/** Return as much of a text as fits a width, estimated by the mean width of a letter, both in px. */
function fitted(text: string, width: number, letter: number): string {
  const most = Math.max(1, Math.floor(width / letter));
  const letters = [...text.replace(/\s+/g, " ")];
  return letters.length <= most ? letters.join("") : `${letters.slice(0, most - 1).join("")}…`;
}

/** Return the picture of a graph. `color` returns the value of a style token such as `--ink`. */
export function svgPictureOf(
  graph: Graph,
  places: ReadonlyMap<Key, Position>,
  sizes: Sizes,
  color: (token: string) => string,
): SvgPicture {
  return new Painter(graph, places, sizes, color).picture();
}

class Painter {
  private readonly nodes: CanvasNode[];
  private readonly bundles: readonly Bundle[];
  private readonly scene: Scene;
  private readonly lines: LineMap;
  private readonly pills: ReadonlyMap<string, PillSize | null>;
  private readonly notes: readonly Note[];
  private readonly handOf: HandOvers;
  private readonly sizes: Sizes;
  private readonly direction: Direction;
  private readonly color: (token: string) => string;
  private readonly robotColor: (robot: string) => string;

  constructor(
    graph: Graph,
    places: ReadonlyMap<Key, Position>,
    sizes: Sizes,
    color: (token: string) => string,
  ) {
    this.sizes = sizes;
    this.direction = graph.direction;
    this.color = color;
    this.robotColor = colorsAmong(robotNames(graph.actions));
    const options = {
      places: new Map(places),
      selected: new Set<string>(),
      progress: new Map(),
      marks: NO_PROBLEM_MARKS,
      measured: sizes,
    };
    this.nodes = nodesOf(graph, options);
    this.bundles = graph.relations.flatMap(bundlesOf);
    this.scene = sceneOf(graph, options, null);
    this.lines = routed(this.scene).lines;
    this.pills = new Map(this.scene.lines.map(({ id, pill }) => [id, pill]));
    this.notes = notesOf(graph);
    this.handOf = handOversIn(graph.relations, robotOf(graph));
  }

  picture(): SvgPicture {
    const parts = [
      ...this.notes.filter(({ kind }) => kind === "frame").map((note) => this.frame(note)),
      ...this.bundles.map((bundle) => this.line(bundle)),
      ...this.nodes.map((node) => this.node(node)),
      ...this.bundles.map((bundle) => this.pill(bundle)),
      ...this.notes.filter(({ kind }) => kind === "note").map((note) => this.note(note)),
    ];
    const [left, top, right, bottom] = this.bounds();
    const [width, height] = [right - left + 2 * MARGIN, bottom - top + 2 * MARGIN];
    const view = `${left - MARGIN} ${top - MARGIN} ${width} ${height}`;
    const svg =
      `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="${view}" ` +
      `font-family="${FONT}" font-size="13">\n` +
      `<rect x="${left - MARGIN}" y="${top - MARGIN}" width="${width}" height="${height}" fill="${this.paint("--canvas")}"/>\n` +
      `${parts.filter(Boolean).join("\n")}\n</svg>\n`;
    return { svg, width, height };
  }

  /** Return the escaped value of a token; `var(--token)` is accepted, too. */
  private paint(token: string): string {
    const name = /^var\((--[\w-]+)\)$/.exec(token)?.[1] ?? token;
    return escaped(this.color(name) || "#888888");
  }

  private size(key: Key, kind: string) {
    return this.sizes.get(key) ?? (kind === "end" ? pillSize(this.direction) : CARD);
  }

  private bounds(): [number, number, number, number] {
    const boxes = [
      ...this.nodes.map(({ id, type, position: { x, y } }) => {
        const { width, height } = this.size(id, type ?? "");
        return [x, y - 12, x + width, y + height + 12];
      }),
      ...this.notes.map(({ at, size }) => [at[0], at[1] - 22, at[0] + size[0], at[1] + size[1]]),
      ...[...this.lines.values()].flatMap(({ points }) =>
        points.map(([x, y]) => [x - 6, y - 6, x + 6, y + 6]),
      ),
    ];
    const least = (i: number) => boxes.reduce((n, box) => Math.min(n, box[i] ?? n), Infinity);
    const most = (i: number) => boxes.reduce((n, box) => Math.max(n, box[i] ?? n), -Infinity);
    return [least(0), least(1), most(2), most(3)].map(Math.round) as [
      number,
      number,
      number,
      number,
    ];
  }

  private text(words: string, x: number, y: number, more: string): string {
    return `<text x="${x}" y="${y}" ${more}>${escaped(words)}</text>`;
  }

  private node(node: CanvasNode): string {
    if (node.type === "action") return this.card(node);
    return node.type === "end" ? this.end(node) : "";
  }

  private card({ id, position: { x, y }, data }: Extract<CanvasNode, { type?: "action" }>): string {
    const { action } = data;
    const { width, height } = this.size(id, "action");
    const robot = this.paint(this.robotColor(action.actor));
    const ink = `fill="${this.paint("--ink")}"`;
    const dash = action.missing ? ` stroke-dasharray="5 4"` : "";
    const lines = cardRows(action.inputs, data.givers)
      .slice(0, CARD_LINES)
      .map(({ name, kind, text }, i) =>
        this.text(
          fitted(`${name} ${kind === "from" ? "← " : ""}${text}`, width - 30, 6.7),
          x + 16,
          y + 46 + i * 16,
          `fill="${this.paint("--ink2")}" font-family="${MONO}" font-size="11"`,
        ),
      );
    const tag = fitted(data.robot, 75, 6.4);
    return [
      `<rect x="${x}" y="${y}" width="${width}" height="${height}" rx="12" fill="${this.paint("--raised")}" stroke="${this.paint("--line2")}"${dash}/>`,
      `<rect x="${x + 5}" y="${y + 12}" width="3" height="${height - 24}" rx="1.5" fill="${robot}"/>`,
      this.text(
        fitted(shownName(action.name), width - 60, 7.4),
        x + 16,
        y + 25,
        `${ink} font-weight="600"`,
      ),
      this.text(
        String(action.instanceId),
        x + width - 13,
        y + 25,
        `fill="${this.paint("--ink3")}" font-size="11.5" text-anchor="end"`,
      ),
      ...lines,
      ...(tag === ""
        ? []
        : [
            `<rect x="${x + 12}" y="${y - 10}" width="${tag.length * 6.4 + 14}" height="18" rx="6" fill="${robot}"/>`,
            this.text(
              tag,
              x + 19,
              y + 3,
              `fill="${this.paint("--on-accent")}" font-size="10.5" font-weight="600"`,
            ),
          ]),
      ...OUTCOMES.map((outcome, i) =>
        this.direction === "right"
          ? this.outcome(outcome, x + width, y + height / 2 + (i - 1.5) * 22)
          : this.outcome(outcome, x + width * (0.14 + 0.24 * i), y + height),
      ),
    ].join("");
  }

  private outcome(outcome: Precondition, x: number, y: number): string {
    const stroke = this.paint(outcomeColor[outcome]);
    return (
      `<circle cx="${x}" cy="${y}" r="9" fill="${this.paint("--raised")}" stroke="${stroke}" stroke-width="1.6"/>` +
      this.text(
        SIGNS[outcome],
        x,
        y + 4,
        `fill="${stroke}" font-size="11" font-weight="700" text-anchor="middle"`,
      )
    );
  }

  private end({ position: { x, y }, data }: Extract<CanvasNode, { type?: "end" }>): string {
    const color = this.paint(data.end === "entry" ? "--true" : "--ink2");
    const middle = x + pillSize(this.direction).width / 2;
    const left = middle - 42;
    return (
      `<rect x="${left}" y="${y}" width="84" height="32" rx="16" fill="${this.paint("--raised")}" stroke="${color}" stroke-width="1.5"/>` +
      this.text(
        data.end === "entry" ? "Entry" : "Exit",
        middle,
        y + 21,
        `fill="${color}" font-size="12.5" font-weight="650" text-anchor="middle"`,
      )
    );
  }

  private colorOf({ entry, response, outcomes: [only, ...others] }: Bundle): string {
    if (!entry && response === "ignore") return this.paint("--ink4");
    return this.paint(!entry && only && others.length === 0 ? outcomeColor[only] : "--edge");
  }

  private line(bundle: Bundle): string {
    const line = this.lines.get(bundle.id);
    const [x, y] = line?.points.at(-1) ?? [0, 0];
    if (!line) return "";
    const color = this.colorOf(bundle);
    const dash = bundle.optional ? ` stroke-dasharray="5 4"` : "";
    const head =
      line.direction === "right"
        ? `M${x - 8} ${y - 4.5}L${x} ${y}L${x - 8} ${y + 4.5}Z`
        : `M${x - 4.5} ${y - 8}L${x} ${y}L${x + 4.5} ${y - 8}Z`;
    return (
      `<path d="${pathOf(line.points)}" fill="none" stroke="${color}" stroke-width="1.8"${dash}/>` +
      `<path d="${head}" fill="${color}"/>`
    );
  }

  private pill(bundle: Bundle): string {
    const line: RoutedLine | undefined = this.lines.get(bundle.id);
    const size = this.pills.get(bundle.id);
    if (!line?.pill || !size) return "";
    const [x, y] = line.pill;
    const { width, height } = size;
    const glyphs = bundle.outcomes
      .map(
        (outcome) => `<tspan fill="${this.paint(outcomeColor[outcome])}">${SIGNS[outcome]}</tspan>`,
      )
      .join(" ");
    const word = pillWord(bundle);
    const said = word === "" ? "" : ` <tspan fill="${this.paint("--ink2")}">${word}</tspan>`;
    const hand = this.handOf(bundle);
    const room = hand === null ? 0 : HAND_WIDTH;
    return (
      `<rect x="${x - width / 2}" y="${y - height / 2}" width="${width}" height="${height}" rx="10" ` +
      `fill="${this.paint("--raised")}" stroke="${this.paint("--line2")}"/>` +
      `<text x="${x - room / 2}" y="${y + 4}" font-size="11" font-weight="600" text-anchor="middle">${glyphs}${said}</text>` +
      (hand === null ? "" : this.hand(hand, x + width / 2 - room - 5, y))
    );
  }

  /** Draws both robots of an arrow between two, each as a letter in its colour, right of x. */
  private hand(hand: HandOver, x: number, y: number): string {
    const letter = (robot: string, left: number) =>
      `<rect x="${left}" y="${y - 7}" width="14" height="14" rx="4" fill="${this.paint(this.robotColor(robot))}"/>` +
      this.text(
        robot === "" ? "·" : firstLetter(robot),
        left + 7,
        y + 4,
        `fill="${this.paint("--on-accent")}" font-size="11" font-weight="600" text-anchor="middle"`,
      );
    const middle = this.text(
      "›",
      x + HAND_WIDTH / 2,
      y + 4,
      `fill="${this.paint("--ink2")}" font-size="11" font-weight="600" text-anchor="middle"`,
    );
    const words = `<title>${escaped(handOverLabel(hand))}</title>`;
    return `<g>${words}${letter(hand.from, x)}${middle}${letter(hand.to, x + HAND_WIDTH - 14)}</g>`;
  }

  private frame({ at: [x, y], size: [width, height], text, color }: Note): string {
    const ink = this.paint(noteColor[color]);
    return (
      `<rect x="${x}" y="${y}" width="${width}" height="${height}" rx="14" fill="${ink}" fill-opacity="0.07" stroke="${ink}" stroke-opacity="0.6"/>` +
      this.text(
        fitted(text, width - 24, 7),
        x + 12,
        y - 8,
        `fill="${ink}" font-size="12" font-weight="650"`,
      )
    );
  }

  private note({ at: [x, y], size: [width, height], text, color }: Note): string {
    const ink = this.paint(noteColor[color]);
    const most = Math.max(1, Math.floor((height - 16) / 17));
    const lines = wrapped(spokenNote(text), width - 24, 6.6).slice(0, most);
    const spans = lines.map(
      (line, i) => `<tspan x="${x + 12}" y="${y + 22 + i * 17}">${escaped(line)}</tspan>`,
    );
    return (
      `<rect x="${x}" y="${y}" width="${width}" height="${height}" rx="8" fill="${this.paint("--raised")}" stroke="${ink}"/>` +
      `<rect x="${x}" y="${y}" width="${width}" height="${height}" rx="8" fill="${ink}" fill-opacity="0.1"/>` +
      `<text fill="${this.paint("--ink")}" font-size="12.5">${spans.join("")}</text>`
    );
  }
}

const SIGNS: Readonly<Record<Precondition, string>> = {
  on_true: "✓",
  on_false: "✕",
  on_error: "!",
  on_stopped: "■",
};

/** Break a text into lines that are no longer than a width in px, estimated by the mean width of a letter. */
function wrapped(text: string, width: number, letter: number): string[] {
  const most = Math.max(4, Math.floor(width / letter));
  return text.split("\n").flatMap((paragraph) => {
    const lines: string[] = [];
    let line = "";
    for (const word of paragraph.split(/\s+/)) {
      if (line !== "" && line.length + 1 + word.length > most) {
        lines.push(line);
        line = "";
      }
      line = line === "" ? word.slice(0, most) : `${line} ${word}`;
    }
    return [...lines, line];
  });
}

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

/** Return the picture of a graph as a file, in the colours of the page. */
export async function graphPicture(
  graph: Graph,
  places: ReadonlyMap<Key, Position>,
  sizes: Sizes,
  format: "svg" | "png",
): Promise<Blob> {
  const colors = getComputedStyle(document.documentElement);
  const { svg, width, height } = svgPictureOf(graph, places, sizes, (token) =>
    colors.getPropertyValue(token).trim(),
  );
  if (format === "svg") return new Blob([svg], { type: "image/svg+xml" });
  return rasterised(svg, width, height);
}
