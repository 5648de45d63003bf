/** A field with a draft of its own: what is typed is written when it fits and the typing pauses. */
import { Textarea, TextInput, type TextInputProps } from "@mantine/core";
import { useCallback, useEffect, useRef, useState } from "react";
import { keyOf } from "./keys";

const PAUSE = 700; // ms

interface Props {
  label: React.ReactNode;
  value: string;
  /** What is wrong with a draft; null when it fits. */
  check?: (draft: string) => string | null;
  onCommit: (value: string) => void;
  lines?: boolean;
  /** Written on leaving only: the field itself is drawn anew under what it says. */
  onLeaving?: boolean;
  placeholder?: string;
  description?: string;
  mono?: boolean;
  rightSection?: TextInputProps["rightSection"];
  rightSectionWidth?: number;
  leftSection?: TextInputProps["leftSection"];
  /** Where the label is no text. */
  ariaLabel?: string;
  disabled?: boolean;
  autoFocus?: boolean;
  inputMode?: "decimal" | "text";
  /** Of a field of several lines. */
  area?: React.RefObject<HTMLTextAreaElement | null>;
}

/** Invalid drafts stay where they are and are explained; the last valid value stays written. */
export function DraftInput(props: Props) {
  const { value, check, onCommit, lines = false, mono = false, onLeaving = false } = props;
  const [draft, setDraft] = useState<string | null>(null);
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const latest = useRef({ draft, value, check, onCommit });
  latest.current = { draft, value, check, onCommit };
  // A draft stays in its field after it was written: what others write since is newer than it.
  const unwritten = useRef(false);

  const commit = useCallback(() => {
    clearTimeout(timer.current);
    const now = latest.current;
    if (!unwritten.current || now.draft === null || now.check?.(now.draft)) return;
    unwritten.current = false;
    if (now.draft !== now.value) now.onCommit(now.draft);
  }, []);
  useEffect(() => commit, [commit]);

  const shown = draft ?? value;
  const wrong = draft === null ? null : (check?.(draft) ?? null);
  const kept = value === "" ? "" : ` The last valid value, ${value}, is kept.`;
  const change = (text: string) => {
    setDraft(text);
    unwritten.current = true;
    clearTimeout(timer.current);
    if (!onLeaving) timer.current = setTimeout(commit, PAUSE);
  };
  const leave = () => {
    commit();
    if (latest.current.draft !== null && !latest.current.check?.(latest.current.draft))
      setDraft(null);
  };
  const shared = {
    label: props.label,
    value: shown,
    error: wrong === null ? undefined : wrong + kept,
    onBlur: leave,
    ...(props.ariaLabel === undefined ? {} : { "aria-label": props.ariaLabel }),
    ...(props.placeholder === undefined ? {} : { placeholder: props.placeholder }),
    ...(props.description === undefined ? {} : { description: props.description }),
    ...(props.disabled === undefined ? {} : { disabled: props.disabled }),
    ...(props.autoFocus ? { "data-autofocus": true, autoFocus: true } : {}),
    styles: mono ? { input: { fontFamily: "var(--mono)", fontSize: "12px" } } : {},
    spellCheck: false,
  };
  const onEscape = (event: React.KeyboardEvent) => {
    if (keyOf(event) !== "Escape") return;
    clearTimeout(timer.current);
    unwritten.current = false;
    setDraft(null);
  };
  if (lines) {
    return (
      <Textarea
        {...shared}
        ref={props.area}
        autosize
        minRows={2}
        maxRows={10}
        onChange={(event) => change(event.currentTarget.value)}
        onKeyDown={onEscape}
      />
    );
  }
  return (
    <TextInput
      {...shared}
      {...(props.inputMode ? { inputMode: props.inputMode } : {})}
      rightSection={props.rightSection}
      {...(props.rightSectionWidth ? { rightSectionWidth: props.rightSectionWidth } : {})}
      {...(props.leftSection ? { leftSection: props.leftSection, leftSectionWidth: 24 } : {})}
      onChange={(event) => change(event.currentTarget.value)}
      onKeyDown={(event) => {
        onEscape(event);
        if (keyOf(event) === "Enter") leave();
      }}
    />
  );
}
