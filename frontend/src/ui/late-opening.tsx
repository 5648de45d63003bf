/**
 * A button whose menu, or whatever it opens, is loaded when it is first pressed, or before when idle.
 *
 * What places such things is as large as an editor of text, and the first view has none open.
 */
import {
  type ButtonHTMLAttributes,
  cloneElement,
  type ReactElement,
  useEffect,
  useState,
} from "react";
import { OpeningBoundary } from "./lazy-part";

type Button = ReactElement<ButtonHTMLAttributes<HTMLButtonElement>>;

interface Props {
  opens: "menu" | "dialog";
  children: Button;
  /** Returns the element that opens, around the button that it is given. */
  part: (button: Button) => ReactElement;
}

/** Loads a part at the first press of its button. From then on the part draws the button, which gets the focus. */
export function LateOpening({ opens, children, part }: Props) {
  const [wanted, setWanted] = useState(false);
  const state = { "aria-haspopup": opens, "aria-expanded": wanted } as const;
  if (!wanted) return cloneElement(children, { ...state, onClick: () => setWanted(true) });
  const waiting = cloneElement(children, { ...state, autoFocus: true });
  const pressed = cloneElement(children, { autoFocus: true });
  return <OpeningBoundary button={waiting}>{part(pressed)}</OpeningBoundary>;
}

/** Opens what has just been drawn: its button has the focus by then, and has it back on closing. */
export function useOpening(): [opened: boolean, open: (opened: boolean) => void] {
  const [opened, setOpened] = useState(false);
  useEffect(() => setOpened(true), []);
  return [opened, setOpened];
}
