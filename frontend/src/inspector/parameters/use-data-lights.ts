/** While a parameter is in focus, the actions that give and take it stand out on the canvas. */
import { createContext, useEffect, useRef } from "react";
import { cardHighlights } from "../../canvas/card-highlights";
import type { ParameterSide } from "../../graph/document-keys";
import type { Key } from "../../graph/model";
import { type DataFlow, touchedBy } from "../../graph/parameters/data-flow";

/** What reaches whom in the open graph, worked out once for all fields of a form. */
export const DataFlowContext = createContext<DataFlow>(new Map());

/** `paths`: of the parameters that the field is about. */
export function useDataLights(
  flow: DataFlow,
  key: Key,
  side: ParameterSide,
  paths: readonly string[],
) {
  const lit = useRef(false);
  const dim = () => {
    if (lit.current) cardHighlights.set({ touched: null });
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
      cardHighlights.set({
        touched: {
          producers: new Set(all.flatMap(({ producers }) => producers)),
          consumers: new Set(all.flatMap(({ consumers }) => consumers)),
        },
      });
    },
    onBlur: dim,
  };
}
