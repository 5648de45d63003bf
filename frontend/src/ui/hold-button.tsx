/** A button that asks to be held, so that a slip of the finger starts nothing. */
import { Button, type ButtonProps } from "@mantine/core";
import { type KeyboardEvent, type ReactNode, useEffect, useRef, useState } from "react";
import style from "./hold-button.module.css";
import { keyOf } from "./keys";
import { lazyPart, OpeningBoundary } from "./lazy-part";

export const HoldQuestion = lazyPart(() =>
  import("./hold-question").then((part) => part.HoldQuestion),
);

const HOLD = 600; // ms

interface Props {
  label: ReactNode;
  /** Read out and shown on hover. */
  name: string;
  question: string;
  disabled?: boolean;
  size?: ButtonProps["size"];
  icon?: ReactNode;
  /** Whether a press is enough, since nothing moves. */
  isPress?: boolean;
  onHeld: () => void;
}

/** A button that acts when it is held, or, where nothing moves, when it is pressed. */
export function HoldButton({ isPress = false, ...props }: Props) {
  const { label, name, disabled = false, size, icon, onHeld } = props;
  if (!isPress) return <HeldButton {...props} />;
  return (
    <Button
      size={size ?? "sm"}
      disabled={disabled}
      title={name}
      leftSection={icon}
      onClick={onHeld}
    >
      <span aria-hidden>{label}</span>
      <span className="visually-hidden">{name}</span>
    </Button>
  );
}

/**
 * A button that acts when it was held for `HOLD` ms by pointer, Enter or space. A shorter press, as that of a screen
 * reader, asks `question` first.
 */
function HeldButton({ label, name, question, disabled = false, size, icon, onHeld }: Props) {
  const [holding, setHolding] = useState(false);
  // Null until it was asked for the first time.
  const [asking, setAsking] = useState<boolean | null>(null);
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  useEffect(() => () => clearTimeout(timer.current), []);
  useEffect(() => {
    if (!disabled) return;
    clearTimeout(timer.current);
    setHolding(false);
  }, [disabled]);

  const begin = () => {
    if (disabled || holding) return;
    setAsking((was) => was && false);
    setHolding(true);
    timer.current = setTimeout(() => {
      setHolding(false);
      onHeld();
    }, HOLD);
  };
  const letGo = (slipped: boolean) => {
    clearTimeout(timer.current);
    if (holding && slipped) setAsking(true);
    setHolding(false);
  };
  const isHoldKey = (event: KeyboardEvent) => ["Enter", " "].includes(keyOf(event));

  const button = (
    <Button
      size={size ?? "sm"}
      className={style.button ?? ""}
      data-holding={holding || undefined}
      disabled={disabled}
      title={`${name} (hold)`}
      leftSection={icon}
      onPointerDown={(event) => {
        if (event.button === 0) begin();
      }}
      onPointerUp={() => letGo(true)}
      onPointerLeave={() => letGo(false)}
      onPointerCancel={() => letGo(false)}
      onContextMenu={(event) => event.preventDefault()}
      onKeyDown={(event) => {
        if (!isHoldKey(event)) return;
        event.preventDefault();
        if (!event.repeat) begin();
      }}
      onKeyUp={(event) => {
        if (isHoldKey(event)) letGo(true);
      }}
      onBlur={() => letGo(false)}
      onClick={(event) => {
        if (event.detail === 0 && !holding) setAsking(true);
      }}
    >
      <span aria-hidden>{label}</span>
      <span className="visually-hidden">{name}</span>
    </Button>
  );
  if (asking === null) return button;
  return (
    <OpeningBoundary button={button}>
      <HoldQuestion
        opened={asking && !disabled}
        onChange={setAsking}
        name={name}
        question={question}
        onYes={() => {
          setAsking(false);
          onHeld();
        }}
      >
        {button}
      </HoldQuestion>
    </OpeningBoundary>
  );
}
