/** The button of a start: it is held where robots move, and pressed once where nothing does. */
import { Button, type ButtonProps } from "@mantine/core";
import type { ReactNode } from "react";
import { HoldButton } from "../../ui/hold-button";

interface Props {
  /** Robots may move, or a second run beside one that goes on would begin. */
  held: boolean;
  label: ReactNode;
  /** Read out and shown on hover. */
  name: string;
  /** Asked of who presses a button that is to be held, without holding it. */
  question: string;
  disabled: boolean;
  size?: ButtonProps["size"];
  icon?: ReactNode;
  onStart: () => void;
}

export function StartButton({ held, question, onStart, ...look }: Props) {
  if (held) return <HoldButton {...look} question={question} onHeld={onStart} />;
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
