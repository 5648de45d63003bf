/** A point, vector or pose: its numbers in rows, or one by one where each is to be changed. */
import { ActionIcon } from "@mantine/core";
import { IconAdjustments } from "@tabler/icons-react";
import { use, useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ParameterSide } from "../../graph/document-keys";
import { setParameter } from "../../graph/edit";
import { pathWords } from "../../graph/field-words";
import type { Action, Parameter } from "../../graph/model";
import { type InputGiver, readValue, takenGivers } from "../../graph/parameters/data-flow";
import type { NumberRow, ParameterBlock } from "../../graph/parameters/groups";
import { groupChoices } from "../../graph/parameters/output-choices";
import { complaint, shown, typed, withValue } from "../../graph/parameters/values";
import { DraftInput } from "../../ui/draft-input";
import { Tooltip } from "../../ui/tooltip";
import { isolated } from "../../words/isolated";
import { SharedField } from "../fields/shared-field";
import { useInLibrary } from "../fields/view-only";
import style from "../inspector.module.css";
import { DataFlowContext, GiverChips, useDataLights } from "./data-flow";
import flowStyle from "./data-flow.module.css";
import { OutputPicker } from "./output-picker";
import { ParameterField } from "./parameter-field";

interface Props {
  action: Action;
  side: ParameterSide;
  block: Extract<ParameterBlock, { kind: "rows" }>;
}

export function NumberField({
  action,
  side,
  letter,
  parameter,
}: Omit<Props, "block"> & { letter: string; parameter: Parameter }) {
  const { doc } = useEditorContext();
  const field = readValue(parameter);
  const inLibrary = useInLibrary();
  const unwritten = side === "in" && field.required && field.value === null && !inLibrary;
  return (
    <SharedField of={action.key} field={`${side}/${parameter.path}`}>
      <div data-unwritten={unwritten || undefined}>
        <DraftInput
          label={null}
          ariaLabel={`${letter} of ${pathWords(parameter.path.slice(0, parameter.path.lastIndexOf("/")))}`}
          mono
          inputMode="decimal"
          leftSection={<span className="ink2 text-11_5">{letter}</span>}
          value={shown(field)}
          placeholder={unwritten ? "fill in" : ""}
          check={(draft) => complaint(field, draft)}
          onCommit={(draft) => {
            const result = typed("number", draft);
            if (!("ok" in result)) return false;
            const write = (now: string) => withValue(now, result.ok);
            return setParameter(doc, action.key, side, parameter.path, write);
          }}
        />
      </div>
    </SharedField>
  );
}

/** One row of numbers, called by what it is of the whole. */
function Row({
  action,
  side,
  row,
  whole,
}: Omit<Props, "block"> & { row: NumberRow; whole: string }) {
  const name = pathWords(row.prefix.slice(0, -1));
  const fields = row.members.map(({ letter, parameter }) => (
    <NumberField
      key={parameter.path}
      action={action}
      side={side}
      letter={letter}
      parameter={parameter}
    />
  ));
  if (row.prefix === whole) return <div className={flowStyle.row}>{fields}</div>;
  return (
    <fieldset className={flowStyle.rows} aria-label={name}>
      <div className={flowStyle.row}>{fields}</div>
    </fieldset>
  );
}

/** Returns the first giver of each field that has one. */
function givenTo(givers: readonly (readonly InputGiver[])[]): InputGiver[] {
  return givers.flatMap(([first]) => (first ? [first] : []));
}

export function NumberRows({ action, side, block }: Props) {
  const { graph } = useEditorContext();
  const inLibrary = useInLibrary();
  const [open, setOpen] = useState(false);
  const flow = use(DataFlowContext);
  const members = block.rows.flatMap((row) => row.members.map(({ parameter }) => parameter));
  const paths = members.map(({ path }) => path);
  const lights = useDataLights(flow, action.key, side, paths);
  const path = block.prefix.slice(0, -1);
  const name = pathWords(path);
  const of = flow.get(action.key);
  const given = side === "in" ? givenTo(paths.map((each) => takenGivers(of?.get(each)))) : [];
  const groups = given.map((giver) => ({
    ...giver,
    output: giver.output.split("::").slice(0, 1).join("::"),
  }));
  return (
    <SharedField of={action.key} field={`${side}/${path}`}>
      <fieldset className={flowStyle.rows} {...lights}>
        <legend>
          <span className={style.path}>{name}</span>
          <span className={style.type}>{block.word}</span>
          <span className="inline-row gap-2px">
            {side === "in" && !inLibrary && (
              <OutputPicker
                owner={action.key}
                paths={paths}
                name={name}
                choices={() => groupChoices(graph, action, block.prefix, block.word, given)}
                renamed={given.some((giver) => giver.renamed)}
              />
            )}
            <Tooltip label="Show each number by itself, with its name and type">
              <ActionIcon
                size={24}
                disabled={false}
                aria-label={`The numbers of ${isolated(name)} one by one`}
                aria-expanded={open}
                onClick={() => setOpen(!open)}
              >
                <IconAdjustments size={14} aria-hidden />
              </ActionIcon>
            </Tooltip>
          </span>
        </legend>
        {groups.length > 0 && (
          <div className={flowStyle.given}>
            <GiverChips givers={groups} path={path} />
          </div>
        )}
        {!open &&
          (given.length < paths.length || members.some((each) => readValue(each).value !== null)) &&
          block.rows.map((row) => (
            <Row key={row.prefix} action={action} side={side} row={row} whole={block.prefix} />
          ))}
        {open &&
          members.map((parameter) => (
            <SharedField key={parameter.path} of={action.key} field={`${side}/${parameter.path}`}>
              <ParameterField
                action={action}
                side={side}
                parameter={parameter}
                name={pathWords(parameter.path.slice(block.prefix.length))}
              />
            </SharedField>
          ))}
      </fieldset>
    </SharedField>
  );
}
