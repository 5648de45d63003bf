/** On the card of an action that stands for a graph: the way into it. */
import { IconStairsDown } from "@tabler/icons-react";
import { graphsInside, type InsideSignProps } from "../canvas/levels/graphs-inside";
import style from "./levels.module.css";

export function InsideSign({ of, name }: InsideSignProps) {
  return (
    <button
      type="button"
      className={`${style.inside} nodrag`}
      title="Open the graph inside  ]"
      aria-label={`Open the graph inside ${name}`}
      onClick={(event) => {
        event.stopPropagation(); // else the card would be chosen
        graphsInside.now()?.enter(of);
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      <IconStairsDown size={14} aria-hidden />
    </button>
  );
}
