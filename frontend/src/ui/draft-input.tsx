/** A field with a draft of its own: what is typed is written when it fits and the typing pauses. */
import { Autocomplete, Textarea, TextInput, type TextInputProps } from "@mantine/core";
import { type DraftOptions, useDraft } from "./drafts";
import { keyOf } from "./keys";

interface Props extends DraftOptions {
  label: React.ReactNode;
  lines?: boolean;
  placeholder?: string;
  description?: string;
  mono?: boolean;
  rightSection?: TextInputProps["rightSection"];
  rightSectionWidth?: number;
  leftSection?: TextInputProps["leftSection"];
  /** Name for screen readers if the label is no text. */
  ariaLabel?: string;
  inputMode?: "decimal" | "text";
  /** Element of a field with several lines. */
  area?: React.RefObject<HTMLTextAreaElement | null>;
}

/** A text field that writes valid values only. Invalid text stays in the field and is explained. */
export function DraftInput(props: Props) {
  const { value, lines = false, mono = false } = props;
  const field = useDraft(props);
  const kept = value === "" ? "" : ` The last valid value, ${value}, is kept.`;
  const shared = {
    label: props.label,
    value: field.text,
    error: field.wrong === null ? undefined : field.wrong + kept,
    onBlur: field.leave,
    ...(props.ariaLabel === undefined ? {} : { "aria-label": props.ariaLabel }),
    ...(props.placeholder === undefined ? {} : { placeholder: props.placeholder }),
    ...(props.description === undefined ? {} : { description: props.description }),
    styles: mono ? { input: { fontFamily: "var(--mono)", fontSize: "12px" } } : {},
    spellCheck: false,
  };
  const onEscape = (event: React.KeyboardEvent) => {
    if (keyOf(event) === "Escape") field.discard();
  };
  if (lines) {
    return (
      <Textarea
        {...shared}
        ref={props.area}
        autosize
        minRows={2}
        maxRows={10}
        onChange={(event) => field.change(event.currentTarget.value)}
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
      onChange={(event) => field.change(event.currentTarget.value)}
      onKeyDown={(event) => {
        onEscape(event);
        if (keyOf(event) === "Enter") field.leave();
      }}
    />
  );
}

interface ChoiceProps extends Omit<DraftOptions, "onLeaving"> {
  label: string;
  /** Values to choose from, which other people have written. */
  data: readonly string[];
  placeholder?: string;
  leftSection?: TextInputProps["leftSection"];
}

/** A field with proposals: written on leaving, or when one of them is taken. */
export function DraftChoice({ label, data, placeholder, leftSection, ...options }: ChoiceProps) {
  const field = useDraft({ ...options, onLeaving: true });
  return (
    <Autocomplete
      label={label}
      size="sm"
      data={[...data]}
      value={field.text}
      error={field.wrong ?? undefined}
      {...(placeholder === undefined ? {} : { placeholder })}
      leftSection={leftSection}
      onChange={field.change}
      onBlur={field.leave}
      onOptionSubmit={(value) => {
        field.change(value);
        field.commit();
      }}
      onKeyDown={(event) => {
        const key = keyOf(event);
        if (key === "Escape") field.discard();
        // A proposal that Enter takes comes first.
        if (key === "Enter") queueMicrotask(field.commit);
      }}
    />
  );
}
