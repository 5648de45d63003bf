/** The button of a start: it is held where robots move, and pressed once where nothing does. */
import { Button, type ButtonProps } from "@mantine/core";
import type { ReactNode } from "react";
import { HoldButton } from "../../ui/hold-button";

interface Props {
  label: ReactNode;
  /** Read out and shown on hover. */
  name: string;
  /**
   * The question to a person who presses the button without holding it; null where one press is enough, since
   * nothing moves and no other run of the graph goes on.
   */
  question: string | null;
  disabled: boolean;
  size?: ButtonProps["size"];
  icon?: ReactNode;
  onStart: () => void;
}

export function StartButton({ question, onStart, ...look }: Props) {
  if (question !== null) return <HoldButton {...look} question={question} onHeld={onStart} />;
  const { label, name, disabled, size, icon } = look;
  return (
    <Button
      variant="filled"
      size={size ?? "sm"}
      disabled={disabled}
      title={name}
      leftSection={icon}
      onClick={onStart}
    >
      <span aria-hidden>{label}</span>
      <span className="visually-hidden">{name}</span>
    </Button>
  );
}
