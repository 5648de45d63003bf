/** On the card of an action that stands for a graph: the way into it, and that graph in place. */
import { IconArrowsDiagonal, IconStairsDown } from "@tabler/icons-react";
import type { MouseEvent } from "react";
import { graphsInside, type InsideSignProps } from "../canvas/graphs-inside";
import { isolated } from "../words/isolated";
import style from "./levels.module.css";

interface SignProps {
  title: string;
  label: string;
  Sign: typeof IconStairsDown;
  onClick: () => void;
}

function SignButton({ title, label, Sign, onClick }: SignProps) {
  return (
    <button
      type="button"
      className={`${style.inside} nodrag`}
      title={title}
      aria-label={label}
      onClick={(event: MouseEvent) => {
        event.stopPropagation(); // else the card would be chosen
        onClick();
      }}
      onDoubleClick={(event) => event.stopPropagation()}
    >
      <Sign size={14} aria-hidden />
    </button>
  );
}

export function InsideSign({ of, name }: InsideSignProps) {
  return (
    <span className={style.signs} data-signs>
      <SignButton
        title="Expand the graph inside  }"
        label={`Expand the graph inside ${isolated(name)}`}
        Sign={IconArrowsDiagonal}
        onClick={() => graphsInside.now()?.expand.toggle(of)}
      />
      <SignButton
        title="Open the graph inside  ]"
        label={`Open the graph inside ${isolated(name)}`}
        Sign={IconStairsDown}
        onClick={() => graphsInside.now()?.enter(of)}
      />
    </span>
  );
}
