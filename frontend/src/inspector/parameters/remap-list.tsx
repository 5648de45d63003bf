/** The renamings of an arrow: outputs that reach the next action, under another name if need be. */
import { ActionIcon, Button, Select } from "@mantine/core";
import { IconArrowDown, IconX } from "@tabler/icons-react";
import { useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import { relationId } from "../../graph/document-keys";
import { setRemap } from "../../graph/edit";
import type { Relation } from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { isolated } from "../../words/isolated";
import style from "../inspector.module.css";
import { misfit, passed, type RemapChoice, sources, targets } from "./remap-choices";

function labelOf({ name, type, reason }: RemapChoice): string {
  return `${name} · ${reason ?? type ?? "no type"}`;
}

function options(choices: readonly RemapChoice[], search: string) {
  const data = choices.map((choice) => ({
    value: choice.name,
    label: labelOf(choice),
    disabled: choice.reason !== null,
  }));
  const fresh = search.trim();
  const known =
    fresh === "" || data.some(({ value, label }) => value === fresh || label === search);
  return known ? data : [...data, { value: fresh, label: `${fresh} · not declared` }];
}

interface PickProps {
  label: string;
  choices: readonly RemapChoice[];
  value: string | null;
  onPick: (name: string | null) => void;
}

function Pick({ label, choices, value, onPick }: PickProps) {
  const [search, setSearch] = useState("");
  const data = options(choices, value === null ? search : "");
  const known = value === null || data.some((option) => option.value === value);
  return (
    <Select
      label={label}
      placeholder="choose, or type a name"
      searchable
      clearable
      nothingFoundMessage="None declared: type a name"
      data={known ? data : [...data, { value, label: `${value} · not declared` }]}
      value={value}
      onChange={onPick}
      onSearchChange={setSearch}
    />
  );
}

function AddRemap({ relation, onDone }: { relation: Relation; onDone: () => void }) {
  const { doc, graph } = useEditorContext();
  const [source, setSource] = useState<string | null>(null);
  const [target, setTarget] = useState<string | null>(null);
  const parent = graph.actions.find((action) => action.key === relation.parent);
  const child = graph.actions.find((action) => action.key === relation.child);
  const outputs = sources(parent, relation.remap);
  const type = outputs.find(({ name }) => name === source)?.type ?? null;
  return (
    <form
      className={style.adding}
      onSubmit={(event) => {
        event.preventDefault();
        if (source === null || target === null) return;
        setRemap(doc, relationId(relation), source, target);
        onDone();
      }}
    >
      <Pick
        label={`Output of ${isolated(endName(graph, relation.parent))}`}
        choices={outputs}
        value={source}
        onPick={(name) => {
          setSource(name);
          setTarget(null);
        }}
      />
      <Pick
        key={source}
        label={`Reaches ${isolated(endName(graph, relation.child))} as`}
        choices={targets(child, relation.remap, type)}
        value={target}
        onPick={setTarget}
      />
      <div className="flex gap-37_5">
        <Button type="submit" size="compact-sm" disabled={source === null || target === null}>
          Add
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={onDone}>
          Cancel
        </Button>
      </div>
    </form>
  );
}

export function RemapList({ relation }: { relation: Relation }) {
  const { doc, graph } = useEditorContext();
  const [adding, setAdding] = useState(false);
  const parent = graph.actions.find((action) => action.key === relation.parent);
  const child = graph.actions.find((action) => action.key === relation.child);
  const same = passed(parent, child, relation.remap);
  return (
    <section className={style.section}>
      <div className={style.heading}>
        <h2>What it carries over</h2>
        <Button size="compact-xs" variant="subtle" onClick={() => setAdding(true)}>
          Rename an output
        </Button>
      </div>
      {same.length > 0 && (
        <p className="m-0 ink2">
          Of the same name and type:{" "}
          <span className="flex-1 break-anywhere text-11_5 mono">{same.join(", ")}</span>
        </p>
      )}
      {same.length === 0 && relation.remap.length === 0 && !adding && (
        <p className="m-0 ink2">
          Nothing: no output of {isolated(endName(graph, relation.parent))} is called and typed as
          an input of {isolated(endName(graph, relation.child))}.
        </p>
      )}
      <ul className="list-reset stack gap-25">
        {relation.remap.map((remap) => {
          const wrong = misfit(parent, child, remap);
          return (
            <li className={style.remap} key={remap.source}>
              <div className={style.arrow}>
                <span className="flex-1 break-anywhere text-11_5 mono">
                  {remap.source} <IconArrowDown size={11} aria-label="as" className={style.as} />{" "}
                  {remap.target}
                </span>
                <ActionIcon
                  size={26}
                  aria-label={`Remove ${remap.source} as ${remap.target}`}
                  onClick={() => setRemap(doc, relationId(relation), remap.source, null)}
                >
                  <IconX size={13} />
                </ActionIcon>
              </div>
              {wrong !== null && <p data-tone="error">{wrong}</p>}
            </li>
          );
        })}
      </ul>
      {adding && <AddRemap relation={relation} onDone={() => setAdding(false)} />}
    </section>
  );
}
