/** The inputs or outputs of an action, and a way to add one. */

import { Autocomplete, Button, Group, Select } from "@mantine/core";
import { IconPlus } from "@tabler/icons-react";
import { use, useMemo, useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ParameterSide } from "../../graph/document-keys";
import { addParameter, asOneEdit } from "../../graph/edit";
import { pathWords } from "../../graph/field-words";
import type { Action, Key, Parameter } from "../../graph/model";
import { dataFlowOf } from "../../graph/parameters/data-flow";
import { blocksOf, type ParameterBlock } from "../../graph/parameters/groups";
import { nameSuggestions, pathFrom, taken } from "../../graph/parameters/names";
import { fresh, GROUPS, TYPES } from "../../graph/parameters/values";
import { countsOf } from "../../graph/problems/problem-kinds";
import { usePendingText } from "../../ui/drafts";
import { fieldOfGroup, ProblemsContext } from "../fields/field-problems";
import { SharedField } from "../fields/shared-field";
import style from "../inspector.module.css";
import { DataFlowContext } from "./data-flow";
import { NumberRows } from "./number-rows";
import { ParameterField } from "./parameter-field";

function SectionCounts({ of, side }: { of: Key; side: ParameterSide }) {
  const here = use(ProblemsContext).filter(
    (told) => told.place === of && fieldOfGroup(told)?.startsWith(`${side}/`),
  );
  const { wrong, fillIn } = countsOf(here);
  if (wrong + fillIn === 0) return null;
  return (
    <span className={style.counts}>
      {wrong > 0 && <span data-kind="wrong">{wrong} wrong</span>}
      {fillIn > 0 && <span data-kind="fill-in">{fillIn} to fill in</span>}
    </span>
  );
}

interface AddProps {
  action: Action;
  side: ParameterSide;
  onDone: () => void;
}

function Suggestion({ name, why }: { name: string; why: string | undefined }) {
  return (
    <span className="stack break-anywhere">
      {name} <small className="ink2">{why}</small>
    </span>
  );
}

function AddParameter({ action, side, onDone }: AddProps) {
  const { doc, graph } = useEditorContext();
  const [name, setName] = useState("");
  usePendingText(name, null);
  const suggestions = nameSuggestions(graph, action, side);
  const [type, setType] = useState<string>("string");
  const path = pathFrom(name);
  const list = side === "in" ? action.inputs : action.outputs;
  const wrong = path === "" ? null : taken(list, path);
  const submit = () => {
    if (path === "" || wrong !== null) return;
    asOneEdit(doc, () => {
      for (const member of GROUPS[type] ?? [null]) {
        const full = member === null ? path : `${path}/${member}`;
        addParameter(doc, action.key, side, full, fresh(member === null ? type : "number"));
      }
    });
    onDone();
  };
  return (
    <form
      className={style.adding}
      onSubmit={(event) => {
        event.preventDefault();
        submit();
      }}
    >
      <Group gap="xs" wrap="nowrap" align="start">
        <Autocomplete
          autoFocus
          size="sm"
          aria-label="Name of the parameter"
          placeholder="name, or group.name"
          value={name}
          error={wrong ?? undefined}
          data={suggestions.map((each) => each.name)}
          limit={20}
          renderOption={({ option }) => (
            <Suggestion
              name={option.value}
              why={suggestions.find((each) => each.name === option.value)?.why}
            />
          )}
          onChange={setName}
          onOptionSubmit={(picked) =>
            setType(suggestions.find((each) => each.name === picked)?.type ?? type)
          }
          comboboxProps={{ width: 220, position: "bottom-start" }}
          flex={1}
        />
        <Select
          aria-label="Type of the parameter"
          data={[
            {
              group: "One value",
              items: [...new Set([...TYPES, ...(GROUPS[type] ? [] : [type])])],
            },
            { group: "A group of numbers", items: Object.keys(GROUPS) },
          ]}
          value={type}
          onChange={(next) => setType(next ?? "string")}
          w={104}
        />
      </Group>
      <Group gap="xs">
        <Button type="submit" size="compact-sm" disabled={path === "" || wrong !== null}>
          Add
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={onDone}>
          Cancel
        </Button>
      </Group>
    </form>
  );
}

interface BlockProps {
  action: Action;
  side: ParameterSide;
  block: ParameterBlock;
}

function Block({ action, side, block }: BlockProps) {
  if (block.kind === "rows") return <NumberRows action={action} side={side} block={block} />;
  const field = (parameter: Parameter, prefix: string) => (
    <SharedField key={parameter.path} of={action.key} field={`${side}/${parameter.path}`}>
      <ParameterField
        action={action}
        side={side}
        parameter={parameter}
        name={pathWords(parameter.path.slice(prefix.length))}
      />
    </SharedField>
  );
  if (block.kind === "single") return field(block.parameter, "");
  return (
    <fieldset className={style.group}>
      <legend>{pathWords(block.prefix.slice(0, -1))}</legend>
      {block.members.map((parameter) => field(parameter, block.prefix))}
    </fieldset>
  );
}

const keyOf = (block: ParameterBlock): string =>
  block.kind === "single"
    ? block.parameter.path
    : `${block.prefix} ${block.kind === "group" ? block.members[0]?.path : ""}`;

export function ParameterList({ action, side }: { action: Action; side: ParameterSide }) {
  const { graph } = useEditorContext();
  const [adding, setAdding] = useState(false);
  const list = side === "in" ? action.inputs : action.outputs;
  const flow = useMemo(() => dataFlowOf(graph), [graph]);
  return (
    <section className={style.section}>
      <div className={style.heading}>
        <h2>{side === "in" ? "Parameters" : "Outputs"}</h2>
        <SectionCounts of={action.key} side={side} />
        <Button
          size="compact-xs"
          variant="subtle"
          leftSection={<IconPlus size={12} />}
          onClick={() => setAdding(true)}
        >
          Add
        </Button>
      </div>
      <DataFlowContext value={flow}>
        {blocksOf(list).map((block) => (
          <Block key={keyOf(block)} action={action} side={side} block={block} />
        ))}
      </DataFlowContext>
      {list.length === 0 && !adding && (
        <p className="m-0 ink2">{side === "in" ? "Takes none." : "Gives none."}</p>
      )}
      {adding && <AddParameter action={action} side={side} onDone={() => setAdding(false)} />}
    </section>
  );
}
