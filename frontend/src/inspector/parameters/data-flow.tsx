/** Shows which outputs an input gets, as chips that lead to the actions that give them, and highlights both ends. */

import { IconArrowLeft } from "@tabler/icons-react";
import { createContext, useEffect, useRef } from "react";
import { useEditorStore } from "../../canvas/editor-store";
import { useEditorContext } from "../../edit-actions/editor-context";
import { flatName, type ParameterSide } from "../../graph/document-keys";
import type { Key } from "../../graph/model";
import { type DataFlow, type InputGiver, touchedBy } from "../../graph/parameters/data-flow";
import { endName } from "../../graph/relation-words";
import style from "./data-flow.module.css";

interface Props {
  givers: readonly InputGiver[];
  /** The path of the input, or of the group. */
  path: string;
}

/** The output's name is said where it differs from that of the input. */
export function GiverChips({ givers, path }: Props) {
  const { graph, select } = useEditorContext();
  const own = flatName(path);
  const shown = [...new Map(givers.map((giver) => [giver.parent, giver])).values()];
  return (
    <span className="wrap fill gap-25">
      {shown.map(({ parent, output }) => (
        <button
          key={parent}
          type="button"
          className={style.chip}
          title="Show the action that gives it"
          onClick={() => select([parent])}
        >
          <IconArrowLeft size={11} aria-label="from" />
          {endName(graph, parent)}
          {output !== own && <span>.{output.replaceAll("::", ".")}</span>}
        </button>
      ))}
    </span>
  );
}

/** The data flow of the open graph, computed once for all fields of a form. */
export const DataFlowContext = createContext<DataFlow>(new Map());

/** `paths`: of the parameters that the field is about. */
export function useDataLights(
  flow: DataFlow,
  key: Key,
  side: ParameterSide,
  paths: readonly string[],
) {
  const { touched } = useEditorStore();
  const lit = useRef(false);
  const dim = () => {
    if (lit.current) touched.set(null);
    lit.current = false;
  };
  const latest = useRef(dim);
  latest.current = dim;
  // A field that goes while it is in focus says nothing by itself.
  useEffect(() => () => latest.current(), []);
  return {
    onFocus: () => {
      const all = paths.map((path) => touchedBy(flow, key, side, path));
      lit.current = true;
      touched.set({
        producers: new Set(all.flatMap(({ producers }) => producers)),
        consumers: new Set(all.flatMap(({ consumers }) => consumers)),
      });
    },
    onBlur: dim,
  };
}
