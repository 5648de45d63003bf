/** A graph in miniature: cards as blocks, arrows as lines in the colours of their outcomes. */
import { useEffect, useMemo, useRef, useState } from "react";
import { type Thumbnail, useThumbnail } from "../api/thumbnails";
import { arrangedByRank } from "../canvas/geometry/ranks";
import { OUTCOMES, outcomeColor } from "../canvas/outcome";
import { ENTRY, EXIT } from "../graph/model";
import { colorOfName } from "../ui/name-colors";

const NEAR = "200px 0px";
const MARGIN = 26;
const CARD = { width: 150, height: 84 } as const;
const PILL = { width: 44, height: 44 } as const;

interface MiniatureBox {
  x: number;
  y: number;
  width: number;
  height: number;
}

interface MiniatureCard {
  robot: string;
  letters: number;
}

interface MiniatureArrow {
  id: string;
  parent: string;
  child: string;
  color: string;
}

interface MiniatureOf {
  boxes: ReadonlyMap<string, MiniatureBox>;
  cards: ReadonlyMap<string, MiniatureCard>;
  arrows: readonly MiniatureArrow[];
}

/** Return what is drawn for a thumbnail, at its places. */
export function miniatureOf({ robots, actions, arrows }: Thumbnail): MiniatureOf {
  const cards = new Map<string, MiniatureCard>(
    actions.map(([robot, letters], i) => [`${i + 1}`, { robot: robots[robot] ?? "", letters }]),
  );
  const keys = [ENTRY, ...cards.keys(), EXIT];
  const drawn = arrows.map(([from, to, outcome], i) => {
    const parent = keys[from] ?? "";
    const color = outcomeColor[OUTCOMES[outcome] ?? "on_true"];
    const id = `${parent}>${keys[to]};${i}`;
    return { id, parent, child: keys[to] ?? "", color: parent === ENTRY ? "var(--ink4)" : color };
  });
  const sizes = new Map(keys.map((key) => [key, cards.has(key) ? CARD : PILL]));
  const relations = drawn.map((arrow, i) => ({ ...arrow, parentOrder: 0, listing: i }));
  const graph = { actions: [...cards.keys()].map((key) => ({ key })), relations };
  const boxes = new Map<string, MiniatureBox>();
  for (const [key, [x, y]] of arrangedByRank(graph, sizes, "right")) {
    boxes.set(key, { x, y, ...(sizes.get(key) ?? CARD) });
  }
  return { boxes, cards, arrows: drawn };
}

function Miniature({ thumbnail }: { thumbnail: Thumbnail }) {
  const { boxes, cards, arrows } = useMemo(() => miniatureOf(thumbnail), [thumbnail]);
  const all = [...boxes.values()];
  const left = Math.min(...all.map((box) => box.x)) - MARGIN;
  const top = Math.min(...all.map((box) => box.y)) - MARGIN;
  const right = Math.max(...all.map((box) => box.x + box.width)) + MARGIN;
  const bottom = Math.max(...all.map((box) => box.y + box.height)) + MARGIN;
  return (
    <svg
      viewBox={`${left} ${top} ${right - left} ${bottom - top}`}
      width="100%"
      height="100%"
      aria-hidden
      focusable="false"
    >
      {arrows.map(({ id, parent, child, color }) => {
        const from = boxes.get(parent);
        const to = boxes.get(child);
        if (!from || !to) return null;
        const [x1, y1] = [from.x + from.width, from.y + from.height / 2];
        const [x2, y2] = [to.x, to.y + to.height / 2];
        const bend = Math.max(30, Math.abs(x2 - x1) / 2);
        return (
          <path
            key={id}
            d={`M${x1} ${y1}C${x1 + bend} ${y1} ${x2 - bend} ${y2} ${x2} ${y2}`}
            fill="none"
            strokeWidth={5}
            style={{ stroke: color }}
          />
        );
      })}
      {[...boxes].map(([key, box]) => {
        const card = cards.get(key);
        return (
          <g key={key}>
            <rect
              {...box}
              rx={card ? 16 : 22}
              strokeWidth={4}
              style={{
                fill: "var(--raised)",
                stroke: key === ENTRY ? "var(--true)" : "var(--line2)",
              }}
            />
            {card && (
              <>
                <rect
                  x={box.x + 12}
                  y={box.y + 18}
                  width={7}
                  height={box.height - 36}
                  rx={3}
                  style={{ fill: colorOfName(card.robot) }}
                />
                <rect
                  x={box.x + 32}
                  y={box.y + 24}
                  width={Math.min(100, 14 + card.letters * 6)}
                  height={11}
                  rx={5}
                  style={{ fill: "var(--ink4)" }}
                />
                <rect
                  x={box.x + 32}
                  y={box.y + 48}
                  width={64}
                  height={9}
                  rx={4}
                  style={{ fill: "var(--line2)" }}
                />
              </>
            )}
          </g>
        );
      })}
    </svg>
  );
}

/** Reads a thumbnail once it comes near the screen: of a long list that are the first few. */
export function GraphPreview({ graph, digest }: { graph: string; digest: string | undefined }) {
  const frame = useRef<HTMLDivElement>(null);
  const [isNear, setNear] = useState(false);
  useEffect(() => {
    const near = new IntersectionObserver(([each]) => each?.isIntersecting && setNear(true), {
      rootMargin: NEAR,
    });
    if (frame.current) near.observe(frame.current);
    return () => near.disconnect();
  }, []);
  const thumbnail = useThumbnail(graph, isNear ? digest : undefined);
  return (
    <div ref={frame} className="block h-full">
      {thumbnail && <Miniature thumbnail={thumbnail} />}
    </div>
  );
}
