/** The form in which a person writes a comment or an answer. */
import { Button, Textarea } from "@mantine/core";
import type { ReactNode } from "react";
import { usePerson } from "../api/people";
import { printedKeys } from "../edit-actions/edit-action";
import { textScope, useKeptText } from "../ui/kept-texts";
import { keyOf } from "../ui/keys";
import style from "./comments.module.css";

interface WriteProps {
  /** The key under which the text is kept until it is sent: the graph and what it is about. */
  place: readonly [graph: string, about: string];
  label: string;
  button: string;
  onSay: (text: string) => void;
  autoFocus?: boolean;
  onCancel?: () => void;
  /** Below the text, as soon as there is some. */
  children?: ReactNode;
}

export function Write(props: WriteProps) {
  const { place, label, button, onSay, autoFocus = false, onCancel, children } = props;
  const { person } = usePerson();
  const [text, setText] = useKeptText(`${textScope(place[0], person.id)}comment/${place[1]}`);
  const cancel = () => {
    setText("");
    onCancel?.();
  };
  const say = () => {
    if (text.trim() === "") return;
    onSay(text.trim());
    setText("");
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
        value={text}
        onChange={(event) => setText(event.currentTarget.value)}
        onKeyDown={(event) => {
          const key = keyOf(event);
          if (key === "Enter" && (event.ctrlKey || event.metaKey)) say();
          if (key === "Escape" && onCancel) cancel();
        }}
      />
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
