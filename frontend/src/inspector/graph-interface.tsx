/** Shows the inputs and outputs of a graph where an action of another graph stands for it. */
import { Checkbox, Select } from "@mantine/core";
import { useMemo } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import type { ParameterSide } from "../graph/document-keys";
import { asOneEdit, setParameter } from "../graph/edit";
import { pathWords } from "../graph/field-words";
import { type InterfaceParameter, interfaceOf } from "../graph/parameters/graph-interface";
import { TYPES, withRequired, withType } from "../graph/parameters/values";
import { endName } from "../graph/relation-words";
import { isolated } from "../words/isolated";
import style from "./inspector.module.css";

interface ParameterProps {
  side: ParameterSide;
  of: InterfaceParameter;
}

/** One parameter of the interface. A change goes to all actions inside that have the parameter, as one edit. */
function InterfaceRow({ side, of: parameter }: ParameterProps) {
  const { doc, graph, mayEdit, select, view } = useEditorContext();
  const { path, type, required, of, mixed } = parameter;
  const name = pathWords(path);
  const change = (now: (text: string) => string) =>
    asOneEdit(doc, () => {
      for (const { key } of of) setParameter(doc, key, side, path, now);
    });
  const keys = of.map(({ key }) => key);
  const types = TYPES.some((known) => known === type) || type === null ? TYPES : [...TYPES, type];
  return (
    <li className="row-wrap gap-50">
      <button
        type="button"
        className={style.owner}
        title={`Of ${keys.map((key) => isolated(endName(graph, key))).join(", ")}`}
        onClick={() => {
          select(keys);
          view.show(keys);
        }}
      >
        <bdi>{name}</bdi>
      </button>
      <Select
        size="xs"
        w={104}
        aria-label={`Type of ${isolated(name)}`}
        data={[...types]}
        value={type}
        disabled={!mayEdit}
        error={mixed}
        onChange={(next) => next !== null && change((text) => withType(text, next))}
      />
      {side === "in" && (
        <Checkbox
          size="xs"
          label="required"
          checked={required}
          disabled={!mayEdit}
          onChange={({ currentTarget: { checked } }) =>
            change((text) => withRequired(text, checked))
          }
        />
      )}
      {mixed && (
        <p className="m-0 w-full ink-error text-12">
          Actions of this graph take it with different types.
        </p>
      )}
    </li>
  );
}

interface InterfaceSideProps {
  side: ParameterSide;
  title: string;
  parameters: readonly InterfaceParameter[];
}

function InterfaceSide({ side, title, parameters }: InterfaceSideProps) {
  if (parameters.length === 0) return null;
  return (
    <section className={style.section} aria-label={title}>
      <div className={style.heading}>
        <h2>{title}</h2>
      </div>
      <ul className="list-reset stack gap-37_5">
        {parameters.map((each) => (
          <InterfaceRow key={each.path} side={side} of={each} />
        ))}
      </ul>
    </section>
  );
}

export function GraphInterface() {
  const { graph } = useEditorContext();
  const { inputs, outputs } = useMemo(() => interfaceOf(graph), [graph]);
  return (
    <>
      <InterfaceSide side="in" title="Takes, inside of another graph" parameters={inputs} />
      <InterfaceSide side="out" title="Gives there" parameters={outputs} />
    </>
  );
}
