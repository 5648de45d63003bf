/** The button of a start: it is held where robots move, and pressed once where nothing does. */
import { Button, type ButtonProps } from "@mantine/core";
import { type PointerEvent, type ReactNode, useRef } from "react";
import { HoldButton } from "../../ui/hold-button";
import style from "./start-control.module.css";

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

const LONG = 400; // ms; browsers take a longer press of a finger for no click

/**
 * Presses of a finger that last too long to be a click, so that holding a button starts as pressing it
 * does. Where a browser sends the click all the same, one start comes of both. A disabled button still gets
 * events of pointers: they start nothing.
 */
function usePress(disabled: boolean, onPress: () => void) {
  const down = useRef<number | null>(null);
  const taken = useRef(Number.NEGATIVE_INFINITY);
  const forget = () => {
    down.current = null;
  };
  return {
    onPointerDown: (event: PointerEvent) => {
      if (disabled) return;
      down.current = event.pointerType === "touch" ? event.timeStamp : null;
    },
    onPointerUp: (event: PointerEvent<HTMLElement>) => {
      const held = down.current !== null && event.timeStamp - down.current >= LONG;
      forget();
      if (disabled || !held) return;
      const box = event.currentTarget.getBoundingClientRect();
      const inside =
        event.clientX >= box.left &&
        event.clientX <= box.right &&
        event.clientY >= box.top &&
        event.clientY <= box.bottom;
      if (!inside) return; // a finger stays with the button where it came down
      taken.current = event.timeStamp;
      onPress();
    },
    onPointerCancel: forget,
    onContextMenu: (event: { preventDefault: () => void }) => {
      if (down.current !== null) event.preventDefault();
    },
    onClick: (event: { timeStamp: number }) => {
      if (event.timeStamp - taken.current >= LONG) onPress();
    },
  };
}

export function StartButton({ question, onStart, ...look }: Props) {
  const press = usePress(look.disabled, onStart);
  if (question !== null) return <HoldButton {...look} question={question} onHeld={onStart} />;
  const { label, name, disabled, size, icon } = look;
  return (
    <Button
      variant="filled"
      size={size ?? "sm"}
      disabled={disabled}
      title={name}
      leftSection={icon}
      className={style.press ?? ""}
      {...press}
    >
      <span aria-hidden>{label}</span>
      <span className="visually-hidden">{name}</span>
    </Button>
  );
}
