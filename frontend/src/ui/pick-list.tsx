/** A search field with what it finds below: arrows choose, Enter takes. */
import { Kbd, TextInput } from "@mantine/core";
import { IconSearch } from "@tabler/icons-react";
import { type ReactNode, useEffect, useId, useRef, useState } from "react";
import { keyOf } from "./keys";
import style from "./pick-list.module.css";
import { useTypedAhead } from "./typed-ahead";

export interface Option {
  readonly id: string;
  readonly label: string;
  readonly sub?: string;
  /** Also found by these words. */
  readonly also?: string;
  readonly icon?: ReactNode;
  readonly right?: ReactNode;
  /** Heading over the first of its kind. */
  readonly group?: string;
  readonly disabled?: boolean;
}

interface Props {
  label: string;
  placeholder: string;
  /** Returns the options for a search; the first one is chosen. */
  find: (search: string) => readonly Option[];
  onPick: (id: string) => void;
  onSearch?: (search: string) => void;
  none: string;
  take?: string;
  /** Returns the text that was typed before the field was rendered. */
  initial?: () => string;
  /** A key in the empty field; whether it has been taken. */
  onEmptyKey?: (event: React.KeyboardEvent) => boolean;
}

/**
 * Return the options in which every word of the search occurs; names that begin with the search
 * come first.
 */
export function matching(options: readonly Option[], search: string): Option[] {
  const words = search.toLowerCase().split(/\s+/).filter(Boolean);
  const rank = ({ label, sub = "", also = "" }: Option): number => {
    const name = label.toLowerCase();
    const all = `${name} ${sub} ${also}`.toLowerCase();
    if (!words.every((word) => all.includes(word))) return 9;
    if (words.length === 0 || name.startsWith(words.join(" "))) return 0;
    return words.every((word) => name.includes(word)) ? 1 : 2;
  };
  return options
    .map((option) => ({ option, rank: rank(option) }))
    .filter((each) => each.rank < 9)
    .sort((a, b) => a.rank - b.rank)
    .map((each) => each.option);
}

/** The id of an option, for `aria-activedescendant` of the field that it belongs to. */
export const optionId = (list: string, at: number): string => `${list}-${at}`;

interface OptionListProps {
  id: string;
  label: string;
  options: readonly Option[];
  /** The chosen one. */
  at: number;
  grouped?: boolean;
  /** Text if there is no option. */
  none?: string;
  onPoint: (at: number) => void;
  onPick: (option: Option) => void;
}

/** List of options below a field, which keeps the focus and handles the keys. */
export function OptionList(props: OptionListProps) {
  const { id, label, options, at, grouped = false, none, onPoint, onPick } = props;
  const list = useRef<HTMLDivElement>(null);
  useEffect(() => {
    list.current?.querySelector(`[id="${optionId(id, at)}"]`)?.scrollIntoView({ block: "nearest" });
  }, [at, id]);
  let heading: string | undefined;
  return (
    <div id={id} ref={list} role="listbox" aria-label={label} className={style.list}>
      {options.map((option, i) => {
        const head = grouped && option.group !== heading ? option.group : undefined;
        heading = option.group;
        return (
          <div key={option.id} role="presentation">
            {head && (
              <div className={style.group} role="presentation">
                {head}
              </div>
            )}
            {/* biome-ignore lint/a11y/useKeyWithClickEvents: keys are handled by the field */}
            {/* biome-ignore lint/a11y/useFocusableInteractive: focus stays in the field */}
            <div
              id={optionId(id, i)}
              role="option"
              aria-selected={i === at}
              aria-disabled={option.disabled || undefined}
              className={style.item}
              onPointerMove={() => onPoint(i)}
              onClick={() => onPick(option)}
            >
              <span className={style.icon}>{option.icon}</span>
              <span className="stack fill">
                <span className="truncate weight-500">{option.label}</span>
                {option.sub && <span className="truncate faint-11_5">{option.sub}</span>}
              </span>
              {option.right}
            </div>
          </div>
        );
      })}
      {options.length === 0 && none !== undefined && <p className={style.none}>{none}</p>}
    </div>
  );
}

export function PickList(props: Props) {
  const { label, placeholder, find, onPick, onSearch, none, take = "take" } = props;
  const { initial, onEmptyKey } = props;
  const [search, setSearch] = useState(() => initial?.() ?? "");
  const [at, setAt] = useState(0);
  const field = useRef<HTMLInputElement>(null);
  useTypedAhead(field, (text) => {
    setSearch(text);
    onSearch?.(text);
  });
  const id = useId();
  const options = find(search);
  const pick = (option: Option | undefined) => {
    if (option && !option.disabled) onPick(option.id);
  };
  const onKeyDown = (event: React.KeyboardEvent) => {
    const last = options.length - 1;
    const key = keyOf(event);
    if (key === "ArrowDown") setAt((i) => (i >= last ? 0 : i + 1));
    else if (key === "ArrowUp") setAt((i) => (i <= 0 ? last : i - 1));
    else if (key === "Home" && search === "") setAt(0);
    else if (key === "End" && search === "") setAt(last);
    else if (key === "Enter") pick(options[at]);
    else if (search !== "" || !onEmptyKey?.(event)) return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <div className="stack min-h-0">
      <TextInput
        ref={field}
        autoFocus
        data-autofocus
        leftSection={<IconSearch size={15} aria-hidden />}
        placeholder={placeholder}
        value={search}
        onChange={(event) => {
          setSearch(event.currentTarget.value);
          onSearch?.(event.currentTarget.value);
          setAt(0);
        }}
        onKeyDown={onKeyDown}
        role="combobox"
        aria-expanded="true"
        aria-controls={id}
        aria-activedescendant={options.length > 0 ? optionId(id, at) : undefined}
        aria-label={label}
        autoComplete="off"
        spellCheck={false}
      />
      <OptionList
        id={id}
        label={label}
        options={options}
        at={at}
        grouped={search === ""}
        none={none}
        onPoint={setAt}
        onPick={pick}
      />
      <p className={style.help} data-keys>
        <Kbd>↑</Kbd> <Kbd>↓</Kbd> choose · <Kbd>Enter</Kbd> {take} · <Kbd>Esc</Kbd> close
      </p>
    </div>
  );
}
