/** One parameter: what it is called, its value or what gives it, and what else it is. */
import { ActionIcon, Button, Group, Switch } from "@mantine/core";
import { IconAdjustments, IconLock, IconMessageQuestion, IconTrash } from "@tabler/icons-react";
import { type ReactNode, use, useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ParameterSide } from "../../graph/document-keys";
import { removeParameter, renameParameter, setParameter } from "../../graph/edit";
import { pathWords } from "../../graph/field-words";
import type { Action, Parameter } from "../../graph/model";
import { askOf } from "../../graph/parameters/asked-inputs";
import { type InputGiver, readValue, takenGivers } from "../../graph/parameters/data-flow";
import { pathFrom, taken } from "../../graph/parameters/names";
import { outputChoices } from "../../graph/parameters/output-choices";
import {
  allowedLines,
  type ParameterValue,
  parameterValueOf,
  TYPES,
  withAllowed,
  withLock,
  withRequired,
  withType,
} from "../../graph/parameters/values";
import { DraftChoice, DraftInput } from "../../ui/draft-input";
import { Tooltip } from "../../ui/tooltip";
import { isolated } from "../../words/isolated";
import { useInLibrary } from "../fields/view-only";
import style from "../inspector.module.css";
import { AskSetting } from "./ask-setting";
import { DataFlowContext, GiverChips, useDataLights } from "./data-flow";
import flowStyle from "./data-flow.module.css";
import { OutputPicker } from "./output-picker";
import { ParameterInput } from "./parameter-value";

interface Props {
  action: Action;
  side: ParameterSide;
  parameter: Parameter;
  /** The name within its group. */
  name: string;
}

interface LabelProps {
  name: string;
  /** The name with its groups. */
  fullName: string;
  field: ParameterValue;
  /** Its author has marked it. */
  asked: boolean;
  open: boolean;
  onOpen: () => void;
}

function Label({ name, fullName, field, asked, open, onOpen }: LabelProps) {
  return (
    <span className={style.label}>
      <span className={style.path} title={fullName}>
        {name}
      </span>
      <span className={style.type}>
        {field.type ?? "no type"}
        {!field.required && " · optional"}
      </span>
      {asked && (
        <Tooltip label="Asked at the start">
          <IconMessageQuestion size={13} aria-label="asked at the start" />
        </Tooltip>
      )}
      {field.locked && (
        <Tooltip label="Locked: outputs of other actions never replace this value">
          <IconLock size={12} aria-label="locked" />
        </Tooltip>
      )}
      <Tooltip label="Name, type, allowed values …">
        <ActionIcon
          size={24}
          className={style.remove ?? ""}
          disabled={false}
          aria-label={`What the parameter ${isolated(fullName)} is`}
          aria-expanded={open}
          onClick={(event) => {
            event.preventDefault();
            onOpen();
          }}
        >
          <IconAdjustments size={14} />
        </ActionIcon>
      </Tooltip>
    </span>
  );
}

interface InputProps {
  action: Action;
  parameter: Parameter;
  label: ReactNode;
  givers: readonly InputGiver[];
}

/** Shows the giver of an input in the place of its field; the input's own value is used until then. */
function Given({ action, parameter, label, givers }: InputProps) {
  const renamed = givers.some((giver) => giver.renamed);
  return (
    <div className={flowStyle.giving}>
      <div>{label}</div>
      <div className={flowStyle.given} data-given>
        <GiverChips givers={givers} path={parameter.path} />
        <Picker action={action} parameter={parameter} givers={givers} renamed={renamed} />
      </div>
    </div>
  );
}

interface PickerProps extends Omit<InputProps, "label"> {
  renamed: boolean;
}

function Picker({ action, parameter, givers, renamed }: PickerProps) {
  const { graph } = useEditorContext();
  return (
    <OutputPicker
      owner={action.key}
      paths={[parameter.path]}
      name={pathWords(parameter.path)}
      choices={() => outputChoices(graph, action, parameter.path, givers)}
      renamed={renamed}
    />
  );
}

/** The field of a value; at its end an input has the outputs that it can come from. */
export function ParameterValueField({
  action,
  side,
  parameter,
  label,
}: Omit<Props, "name"> & { label: ReactNode }) {
  const { doc } = useEditorContext();
  const flow = use(DataFlowContext);
  const field = readValue(parameter);
  const givers = side === "in" ? takenGivers(flow.get(action.key)?.get(parameter.path)) : [];
  const given = givers.length > 0;
  const inLibrary = useInLibrary();
  const input = (
    <ParameterInput
      label={given ? "" : label}
      name={pathWords(parameter.path)}
      field={field}
      parameter={parameter}
      write={(change) => setParameter(doc, action.key, side, parameter.path, change)}
      end={
        side === "in" && !given && !field.locked && !inLibrary ? (
          <Picker action={action} parameter={parameter} givers={givers} renamed={false} />
        ) : null
      }
    />
  );
  if (!given) return input;
  return (
    <>
      <Given action={action} parameter={parameter} label={label} givers={givers} />
      {field.value !== null && (
        <div className={flowStyle.until}>
          Until it comes:
          {input}
        </div>
      )}
    </>
  );
}

export function ParameterField({ action, side, parameter, name }: Props) {
  const [open, setOpen] = useState(false);
  const flow = use(DataFlowContext);
  const field = readValue(parameter);
  const lights = useDataLights(flow, action.key, side, [parameter.path]);
  const list = side === "in" ? action.inputs : action.outputs;
  const inLibrary = useInLibrary();
  const unwritten = side === "in" && field.required && field.value === null && !inLibrary;
  return (
    <div className={style.parameter} data-unwritten={unwritten || undefined} {...lights}>
      <ParameterValueField
        action={action}
        side={side}
        parameter={parameter}
        label={
          <Label
            name={name}
            fullName={pathWords(parameter.path)}
            field={field}
            asked={side === "in" && askOf(action, parameter.path) !== null}
            open={open}
            onOpen={() => setOpen(!open)}
          />
        }
      />
      {open && (
        <ParameterSettings
          action={action}
          side={side}
          parameter={parameter}
          others={list.filter((other) => other !== parameter)}
          onClose={() => setOpen(false)}
        />
      )}
    </div>
  );
}

interface SettingsProps {
  action: Action;
  side: ParameterSide;
  parameter: Parameter;
  others: readonly Parameter[];
  onClose: () => void;
}

function ParameterSettings({ action, side, parameter, others, onClose }: SettingsProps) {
  const { doc } = useEditorContext();
  const owner = action.key;
  const field = parameterValueOf(parameter.text);
  const name = pathWords(parameter.path);
  const write = (change: (now: string) => string) =>
    setParameter(doc, owner, side, parameter.path, change);
  return (
    <section className={style.adding} aria-label={`What the parameter ${isolated(name)} is`}>
      <DraftInput
        label="Name"
        value={name}
        onLeaving
        check={(draft) => taken(others, pathFrom(draft))}
        onCommit={(draft) => renameParameter(doc, owner, side, parameter.path, pathFrom(draft))}
      />
      <DraftChoice
        label="Type"
        data={TYPES}
        value={field.type ?? ""}
        onCommit={(type) => type.trim() === "" || write((now) => withType(now, type.trim()))}
      />
      {field.native !== null && (
        <DraftInput
          label="Allowed values, one on each line"
          lines
          value={allowedLines(field)}
          placeholder="anything"
          check={(draft) => {
            const result = withAllowed(parameter.text, draft);
            return "wrong" in result ? result.wrong : null;
          }}
          onCommit={(draft) =>
            write((now) => {
              const result = withAllowed(now, draft);
              return "ok" in result && result.ok !== null ? result.ok : now;
            })
          }
        />
      )}
      <Switch
        label="Required"
        description="The action does not run without a value"
        checked={field.required}
        onChange={(event) => {
          const required = event.currentTarget.checked;
          write((now) => withRequired(now, required));
        }}
      />
      {side === "in" && (
        <Switch
          label="Locked"
          description="Outputs of other actions never replace the value"
          checked={field.locked}
          onChange={(event) => {
            const locked = event.currentTarget.checked;
            write((now) => withLock(now, locked));
          }}
        />
      )}
      {side === "in" && <AskSetting action={action} parameter={parameter} />}
      <Group gap="xs">
        <Button size="compact-sm" disabled={false} onClick={onClose}>
          Close
        </Button>
        <Button
          size="compact-sm"
          variant="subtle"
          color="red"
          leftSection={<IconTrash size={13} aria-hidden />}
          aria-label={`Remove the parameter ${isolated(name)}`}
          onClick={() => removeParameter(doc, owner, side, parameter.path)}
        >
          Remove
        </Button>
      </Group>
    </section>
  );
}
