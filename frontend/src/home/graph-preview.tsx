/** A graph in miniature: cards as blocks, arrows as lines in the colours of their outcomes. */
import { useQuery } from "@tanstack/react-query";
import { useEffect, useMemo, useRef, useState } from "react";
import { graphText } from "../api/graphs";
import { fromUmrf } from "../canvas/from-umrf";
import { arrange } from "../canvas/geometry/arrange";
import { outcomeColor } from "../canvas/outcome";
import { ENTRY, EXIT, type Graph, spokenOutcomes } from "../graph/model";
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

function boxes(graph: Graph): Map<string, MiniatureBox> {
  const keys = [ENTRY, ...graph.actions.map((action) => action.key), EXIT];
  const sizes = new Map(keys.map((key) => [key, key === ENTRY || key === EXIT ? PILL : CARD]));
  const found = new Map<string, MiniatureBox>();
  for (const [key, [x, y]] of arrange(graph, sizes, "right")) {
    found.set(key, { x, y, ...(sizes.get(key) ?? CARD) });
  }
  return found;
}

function Miniature({ graph }: { graph: Graph }) {
  const places = useMemo(() => boxes(graph), [graph]);
  const all = [...places.values()];
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
      {graph.relations.map((relation) => {
        const from = places.get(relation.parent);
        const to = places.get(relation.child);
        if (!from || !to) return null;
        const [x1, y1] = [from.x + from.width, from.y + from.height / 2];
        const [x2, y2] = [to.x, to.y + to.height / 2];
        const bend = Math.max(30, Math.abs(x2 - x1) / 2);
        const outcome = spokenOutcomes(relation.conditions)[0] ?? "on_true";
        const color = relation.parent === ENTRY ? "var(--ink4)" : outcomeColor[outcome];
        return (
          <path
            key={`${relation.parent}>${relation.child};${relation.listing}`}
            d={`M${x1} ${y1}C${x1 + bend} ${y1} ${x2 - bend} ${y2} ${x2} ${y2}`}
            fill="none"
            strokeWidth={5}
            style={{ stroke: color }}
          />
        );
      })}
      {[...places].map(([key, box]) => {
        const end = key === ENTRY || key === EXIT;
        const action = graph.actions.find((candidate) => candidate.key === key);
        return (
          <g key={key}>
            <rect
              {...box}
              rx={end ? 22 : 16}
              strokeWidth={4}
              style={{
                fill: "var(--raised)",
                stroke: key === ENTRY ? "var(--true)" : "var(--line2)",
              }}
            />
            {action && (
              <>
                <rect
                  x={box.x + 12}
                  y={box.y + 18}
                  width={7}
                  height={box.height - 36}
                  rx={3}
                  style={{ fill: colorOfName(action.actor) }}
                />
                <rect
                  x={box.x + 32}
                  y={box.y + 24}
                  width={Math.min(100, 14 + action.name.length * 6)}
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

/** Reads a graph once it comes near the screen: of a long list that are the first few. */
export function GraphPreview({ graph, seq }: { graph: string; seq: number }) {
  const frame = useRef<HTMLDivElement>(null);
  const [isNear, setNear] = useState(false);
  useEffect(() => {
    const near = new IntersectionObserver(([each]) => each?.isIntersecting && setNear(true), {
      rootMargin: NEAR,
    });
    if (frame.current) near.observe(frame.current);
    return () => near.disconnect();
  }, []);
  const umrf = useQuery({
    enabled: isNear,
    queryKey: ["graphs", graph, "umrf", seq],
    queryFn: () => graphText(graph).then((text) => JSON.parse(text) as unknown),
    staleTime: Number.POSITIVE_INFINITY,
    retry: false,
  });
  const drawn = useMemo(() => (umrf.data === undefined ? null : fromUmrf(umrf.data)), [umrf.data]);
  return (
    <div ref={frame} className="block h-full">
      {drawn !== null && drawn.actions.length > 0 && <Miniature graph={drawn} />}
    </div>
  );
}
