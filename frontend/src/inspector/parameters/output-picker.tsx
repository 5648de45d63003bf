/** Takes the value of an input from an output: those that fit and come before, and why not the rest. */
import { ActionIcon, Combobox, useCombobox } from "@mantine/core";
import { IconArrowLeft, IconLinkOff } from "@tabler/icons-react";
import { useState } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import { leaveOutputs, takeOutputs } from "../../graph/edit/parameters";
import type { Key } from "../../graph/model";
import type { OutputChoice } from "../../graph/parameters/output-choices";
import { Tooltip } from "../../ui/tooltip";
import { isolated } from "../../words/isolated";
import style from "./data-flow.module.css";

const MOST = 40;

interface Props {
  owner: Key;
  /** The paths of the input, or of the inputs of a group. */
  paths: readonly string[];
  name: string;
  /** Worked out when the list opens: a graph may have a thousand outputs. */
  choices: () => readonly OutputChoice[];
  /** True if what it gets is renamed; the renaming can be removed. */
  renamed: boolean;
}

const wordsOf = ({ parentName, output, type }: OutputChoice): string =>
  `${parentName}.${output.replaceAll("::", ".")} ${type ?? ""}`.toLowerCase();

function Choice({ choice }: { choice: OutputChoice }) {
  return (
    <Combobox.Option
      value={`${choice.parent} ${choice.output}`}
      disabled={choice.reason !== null}
      className={style.choice ?? ""}
      active={choice.taken}
    >
      <span className={style.from}>
        <IconArrowLeft size={12} aria-hidden /> {choice.parentName}
        <b>.{choice.output.replaceAll("::", ".")}</b>
      </span>
      <span className={style.why}>
        {choice.taken ? "taken now" : (choice.reason ?? choice.type ?? "no type")}
      </span>
    </Combobox.Option>
  );
}

interface ListProps {
  choices: readonly OutputChoice[];
  search: string;
  renamed: boolean;
}

function Choices({ choices, search, renamed }: ListProps) {
  const wanted = choices.filter((choice) => wordsOf(choice).includes(search.trim().toLowerCase()));
  const fitting = wanted.filter(({ reason }) => reason === null);
  const others = wanted.filter(({ reason }) => reason !== null);
  const left = Math.max(0, fitting.length + others.length - MOST);
  return (
    <Combobox.Options mah={280} style={{ overflowY: "auto" }}>
      {renamed && (
        <Combobox.Option value="" className={style.choice ?? ""}>
          <span className={style.from}>
            <IconLinkOff size={13} aria-hidden /> Do not take it from an output
          </span>
        </Combobox.Option>
      )}
      {fitting.length > 0 && (
        <Combobox.Group label="Fits, and comes before">
          {fitting.slice(0, MOST).map((choice) => (
            <Choice key={`${choice.parent} ${choice.output}`} choice={choice} />
          ))}
        </Combobox.Group>
      )}
      {others.length > 0 && (
        <Combobox.Group label="Cannot be taken">
          {others.slice(0, Math.max(0, MOST - fitting.length)).map((choice) => (
            <Choice key={`${choice.parent} ${choice.output}`} choice={choice} />
          ))}
        </Combobox.Group>
      )}
      {wanted.length === 0 && (
        <Combobox.Empty>
          {choices.length === 0
            ? "No action of this graph gives such a value."
            : "No output has this name."}
        </Combobox.Empty>
      )}
      {left > 0 && <Combobox.Footer>{left} more: type a part of the name</Combobox.Footer>}
    </Combobox.Options>
  );
}

export function OutputPicker({ owner, paths, name, choices, renamed }: Props) {
  const { doc } = useEditorContext();
  const [search, setSearch] = useState("");
  const box = useCombobox({
    onDropdownClose: () => {
      box.resetSelectedOption();
      setSearch("");
    },
    onDropdownOpen: () => box.focusSearchInput(),
  });
  const listed = box.dropdownOpened ? choices() : [];
  const pick = (value: string) => {
    box.closeDropdown();
    box.focusTarget();
    const choice = choices().find(({ parent, output }) => `${parent} ${output}` === value);
    if (value === "") leaveOutputs(doc, owner, paths);
    else if (choice?.relation) takeOutputs(doc, choice.relation, choice.ties);
  };
  return (
    <Combobox store={box} onOptionSubmit={pick} position="bottom-end" width={272} shadow="md">
      <Combobox.Target withAriaAttributes={false}>
        <Tooltip label="Take it from an output" disabled={box.dropdownOpened}>
          <ActionIcon
            size={26}
            aria-label={`Take ${isolated(name)} from an output`}
            aria-expanded={box.dropdownOpened}
            onClick={() => box.toggleDropdown()}
          >
            <IconArrowLeft size={14} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </Combobox.Target>
      <Combobox.Dropdown>
        <Combobox.Search
          aria-label={`Outputs for ${isolated(name)}`}
          placeholder="Outputs"
          value={search}
          onChange={(event) => {
            setSearch(event.currentTarget.value);
            box.updateSelectedOptionIndex();
          }}
        />
        <Choices choices={listed} search={search} renamed={renamed} />
      </Combobox.Dropdown>
    </Combobox>
  );
}
