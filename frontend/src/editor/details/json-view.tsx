/** The graph as UMRF JSON, in step with what is selected. */
import { ActionIcon, CopyButton, Skeleton, Tooltip } from "@mantine/core";
import { IconCheck, IconCopy } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useEffect, useMemo, useRef } from "react";
import { graphText } from "../../api/graphs";
import { sentence } from "../../api/http";
import { selectedActions, useBench } from "../bench";
import { type Piece, pieces, rangeOf } from "./json-pieces";
import style from "./json-view.module.css";

const MOST_LINES = 4000;

function Line({ line, marked }: { line: readonly Piece[]; marked: boolean }) {
  return (
    <div className={style.line} data-marked={marked || undefined}>
      {line.map((piece, i) => (
        // biome-ignore lint/suspicious/noArrayIndexKey: pieces of a line have no other name
        <span key={i} data-kind={piece.kind}>
          {piece.text}
        </span>
      ))}
      {"\n"}
    </div>
  );
}

export function JsonView({ graph, seq }: { graph: string; seq: number }) {
  const bench = useBench();
  const frame = useRef<HTMLPreElement>(null);
  const text = useQuery({
    queryKey: ["graphs", graph, "json", seq],
    queryFn: () => graphText(graph),
    placeholderData: (before) => before,
    staleTime: Number.POSITIVE_INFINITY,
    gcTime: 30_000,
  });
  const [selected] = selectedActions(bench);
  const lines = useMemo(() => pieces(text.data ?? ""), [text.data]);
  const marked = useMemo(
    () => (selected ? rangeOf(text.data ?? "", selected.name, selected.instanceId) : null),
    [text.data, selected],
  );
  const first = marked?.[0];
  useEffect(() => {
    if (first === undefined) return;
    frame.current?.children[first]?.scrollIntoView({ block: "start" });
  }, [first]);
  if (text.isError) return <p>{sentence(text.error)}</p>;
  if (!text.data) return <Skeleton height={200} />;
  return (
    <div className={style.json}>
      <div className={style.copy}>
        <CopyButton value={text.data}>
          {({ copied, copy }) => (
            <Tooltip label={copied ? "Copied" : "Copy all"}>
              <ActionIcon onClick={copy} aria-label="Copy the JSON">
                {copied ? <IconCheck size={15} /> : <IconCopy size={15} />}
              </ActionIcon>
            </Tooltip>
          )}
        </CopyButton>
      </div>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: so that it scrolls by keyboard */}
      <pre ref={frame} className={style.text} tabIndex={0}>
        {lines.slice(0, MOST_LINES).map((line, i) => (
          <Line
            // biome-ignore lint/suspicious/noArrayIndexKey: a line is its number
            key={i}
            line={line}
            marked={marked !== null && i >= marked[0] && i <= marked[1]}
          />
        ))}
        {lines.length > MOST_LINES && <div>… {lines.length - MOST_LINES} more lines: export</div>}
      </pre>
    </div>
  );
}
