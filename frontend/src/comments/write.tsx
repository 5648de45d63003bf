/** The form in which a person writes a comment or an answer. */
import { Button, Textarea } from "@mantine/core";
import { type ReactNode, useId, useRef, useState } from "react";
import { useMentionable } from "../api/mentions";
import { usePerson } from "../api/people";
import { printedKeys } from "../edit-actions/edit-action";
import { textScope, useKeptText } from "../ui/kept-texts";
import { keyOf } from "../ui/keys";
import { initials } from "../ui/name-colors";
import { OptionList, optionId } from "../ui/pick-list";
import style from "./comments.module.css";
import { type MentionQuery, mentionedIn, queryAt, suggestions, withMention } from "./mentions";

interface WriteProps {
  /** The key under which the text is kept until it is sent: the graph and what it is about. */
  place: readonly [graph: string, about: string];
  label: string;
  button: string;
  /** `mentions`: the ids of the persons whom the text names. */
  onSay: (text: string, mentions: readonly string[]) => void;
  autoFocus?: boolean;
  onCancel?: () => void;
  /** Below the text, as soon as there is some. */
  children?: ReactNode;
}

export function Write(props: WriteProps) {
  const { place, label, button, onSay, autoFocus = false, onCancel, children } = props;
  const { person } = usePerson();
  const [text, setText] = useKeptText(`${textScope(place[0], person.id)}comment/${place[1]}`);
  const people = useMentionable(person.id);
  const [picked, setPicked] = useState<ReadonlySet<string>>(new Set());
  const [query, setQuery] = useState<MentionQuery | null>(null);
  const [at, setAt] = useState(0);
  const field = useRef<HTMLTextAreaElement>(null);
  const list = useId();
  const options = query === null ? [] : suggestions(people, query.search);
  const isOpen = options.length > 0;
  /** Looks for an `@` before the caret, wherever that is now. */
  const look = (area: HTMLTextAreaElement) => {
    const { selectionStart, selectionEnd, value } = area;
    const found = selectionStart === selectionEnd ? queryAt(value, selectionStart) : null;
    if (found?.at !== query?.at || found?.search !== query?.search) {
      setQuery(found);
      setAt(0);
    }
  };
  const pick = (id: string) => {
    const one = people.find((each) => each.id === id);
    if (one === undefined || query === null) return;
    const made = withMention(text, query, one.name);
    setText(made.text);
    setPicked(new Set([...picked, id]));
    setQuery(null);
    requestAnimationFrame(() => {
      field.current?.focus();
      field.current?.setSelectionRange(made.caret, made.caret);
    });
  };
  /** Handles the keys of the list of people; returns whether it has taken the key. */
  const choose = (key: string): boolean => {
    const last = options.length - 1;
    if (!isOpen) return false;
    if (key === "ArrowDown") setAt(at >= last ? 0 : at + 1);
    else if (key === "ArrowUp") setAt(at <= 0 ? last : at - 1);
    else if (key === "Enter" || key === "Tab") pick(options[at]?.id ?? "");
    else if (key === "Escape") setQuery(null);
    else return false;
    return true;
  };
  const cancel = () => {
    setText("");
    onCancel?.();
  };
  const say = () => {
    if (text.trim() === "") return;
    onSay(text.trim(), mentionedIn(text, people, picked));
    setText("");
    setPicked(new Set());
    setQuery(null);
  };
  return (
    <form
      className={`${style.write} fingers`}
      onSubmit={(event) => {
        event.preventDefault();
        say();
      }}
    >
      <Textarea
        aria-label={label}
        placeholder={`${label} …`}
        autosize
        minRows={1}
        maxRows={8}
        maxLength={10_000}
        autoFocus={autoFocus}
        ref={field}
        value={text}
        aria-autocomplete="list"
        aria-controls={isOpen ? list : undefined}
        aria-activedescendant={isOpen ? optionId(list, at) : undefined}
        onChange={(event) => {
          setText(event.currentTarget.value);
          look(event.currentTarget);
        }}
        onSelect={(event) => look(event.currentTarget)}
        onBlur={() => setQuery(null)}
        onKeyDown={(event) => {
          const key = keyOf(event);
          if (!(event.ctrlKey || event.metaKey) && choose(key)) {
            event.preventDefault();
            event.stopPropagation();
            return;
          }
          if (key === "Enter" && (event.ctrlKey || event.metaKey)) say();
          if (key === "Escape" && onCancel) cancel();
        }}
      />
      {isOpen && (
        // The field keeps the focus, and the keyboard of a phone stays.
        // biome-ignore lint/a11y/noStaticElementInteractions: the options are inside
        <div className={style.people} onMouseDown={(event) => event.preventDefault()}>
          <OptionList
            id={list}
            label="People"
            options={options.map(({ id, name }) => ({ id, label: name, icon: initials(name) }))}
            at={Math.min(at, options.length - 1)}
            onPoint={setAt}
            onPick={({ id }) => pick(id)}
          />
        </div>
      )}
      {text !== "" && children}
      {(text !== "" || onCancel) && (
        <div className={style.buttons}>
          <Button
            type="submit"
            size="compact-sm"
            variant="filled"
            disabled={text.trim() === ""}
            title={printedKeys("Mod+Enter").join(" ")}
          >
            {button}
          </Button>
          {onCancel && (
            <Button size="compact-sm" variant="subtle" onClick={cancel}>
              Cancel
            </Button>
          )}
        </div>
      )}
    </form>
  );
}
