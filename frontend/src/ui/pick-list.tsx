/** A search field with what it finds below: arrows choose, Enter takes. */
import { Kbd, TextInput } from "@mantine/core";
import { IconSearch } from "@tabler/icons-react";
import { type ReactNode, useEffect, useId, useRef, useState } from "react";
import style from "./pick-list.module.css";

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
  /** What there is for a search; the first is chosen. */
  find: (search: string) => readonly Option[];
  onPick: (id: string) => void;
  none: string;
  take?: string;
}

/** Those in which every word of the search occurs; names that begin so come first. */
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

export function PickList({ label, placeholder, find, onPick, none, take = "take" }: Props) {
  const [search, setSearch] = useState("");
  const [at, setAt] = useState(0);
  const id = useId();
  const options = find(search);
  const list = useRef<HTMLDivElement>(null);
  useEffect(() => {
    list.current?.querySelector(`[id="${id}-${at}"]`)?.scrollIntoView({ block: "nearest" });
  }, [at, id]);
  const pick = (option: Option | undefined) => {
    if (option && !option.disabled) onPick(option.id);
  };
  const onKeyDown = (event: React.KeyboardEvent) => {
    const last = options.length - 1;
    if (event.key === "ArrowDown") setAt((i) => (i >= last ? 0 : i + 1));
    else if (event.key === "ArrowUp") setAt((i) => (i <= 0 ? last : i - 1));
    else if (event.key === "Home" && search === "") setAt(0);
    else if (event.key === "End" && search === "") setAt(last);
    else if (event.key === "Enter") pick(options[at]);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  let heading: string | undefined;
  return (
    <div className={style.box}>
      <TextInput
        autoFocus
        data-autofocus
        leftSection={<IconSearch size={15} aria-hidden />}
        placeholder={placeholder}
        value={search}
        onChange={(event) => {
          setSearch(event.currentTarget.value);
          setAt(0);
        }}
        onKeyDown={onKeyDown}
        role="combobox"
        aria-expanded="true"
        aria-controls={id}
        aria-activedescendant={options.length > 0 ? `${id}-${at}` : undefined}
        aria-label={label}
        autoComplete="off"
        spellCheck={false}
      />
      <div id={id} ref={list} role="listbox" aria-label={label} className={style.list}>
        {options.map((option, i) => {
          const head = search === "" && option.group !== heading ? option.group : undefined;
          heading = option.group;
          return (
            <div key={option.id} role="presentation">
              {head && (
                <div className={style.group} role="presentation">
                  {head}
                </div>
              )}
              {/* biome-ignore lint/a11y/useKeyWithClickEvents: keys are handled by the search field */}
              {/* biome-ignore lint/a11y/useFocusableInteractive: focus stays in the search field */}
              <div
                id={`${id}-${i}`}
                role="option"
                aria-selected={i === at}
                aria-disabled={option.disabled || undefined}
                className={style.item}
                onPointerMove={() => setAt(i)}
                onClick={() => pick(option)}
              >
                <span className={style.icon}>{option.icon}</span>
                <span className={style.text}>
                  <span className={style.name}>{option.label}</span>
                  {option.sub && <span className={style.sub}>{option.sub}</span>}
                </span>
                {option.right}
              </div>
            </div>
          );
        })}
        {options.length === 0 && <p className={style.none}>{none}</p>}
      </div>
      <p className={style.help} data-keys>
        <Kbd>↑</Kbd> <Kbd>↓</Kbd> choose · <Kbd>Enter</Kbd> {take} · <Kbd>Esc</Kbd> close
      </p>
    </div>
  );
}
