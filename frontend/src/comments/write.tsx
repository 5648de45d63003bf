/** Where somebody writes a comment or an answer. */
import { Button, Textarea } from "@mantine/core";
import { type ReactNode, useState } from "react";
import { printedKeys } from "../edit-actions/edit-action";
import { keyOf } from "../ui/keys";
import style from "./comments.module.css";

interface WriteProps {
  label: string;
  button: string;
  onSay: (text: string) => void;
  autoFocus?: boolean;
  onCancel?: () => void;
  /** Below the text, as soon as there is some. */
  children?: ReactNode;
}

export function Write({ label, button, onSay, autoFocus = false, onCancel, children }: WriteProps) {
  const [text, setText] = useState("");
  const say = () => {
    if (text.trim() === "") return;
    onSay(text.trim());
    setText("");
  };
  return (
    <form
      className={style.write}
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
          if (key === "Escape") onCancel?.();
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
            <Button size="compact-sm" variant="subtle" onClick={onCancel}>
              Cancel
            </Button>
          )}
        </div>
      )}
    </form>
  );
}
