/**
 * Words about what the mouse rests on.
 *
 * Mantine's brings what places and drives every kind of floating box, which the first view of a page
 * needs for nothing else.
 */
import {
  cloneElement,
  type HTMLAttributes,
  type ReactElement,
  type ReactNode,
  useEffect,
  useId,
  useLayoutEffect,
  useRef,
  useState,
} from "react";
import { createPortal } from "react-dom";
import { keyOf } from "./keys";
import style from "./tooltip.module.css";

const DELAY = 350; // ms
/** Selector of the part of the page in which menus and dialogs open; see `index.html`. */
const MENUS = "[data-mantine-shared-portal-node]";

interface Props {
  label: ReactNode;
  disabled?: boolean;
  /** Lines are broken at this width, px. */
  width?: number;
  /** Also for those who come by key or touch: what it tells is told nowhere else. */
  onFocus?: boolean;
  children: ReactElement<HTMLAttributes<HTMLElement>>;
}

/** Calls `end` when the pointer is elsewhere, also where the browser sends no event to an element disabled meanwhile. */
function useEnd(target: HTMLElement | null, end: () => void): void {
  useEffect(() => {
    if (target === null) return;
    const onOver = ({ target: over }: Event) => {
      const kept = document.activeElement === target && target.matches(":focus-visible");
      if (!kept && !(over instanceof Node && target.contains(over))) end();
    };
    const onKey = (event: KeyboardEvent) => keyOf(event) === "Escape" && end();
    const asking = new AbortController();
    const options = { capture: true, passive: true, signal: asking.signal };
    document.addEventListener("pointerover", onOver, options);
    document.addEventListener("keydown", onKey, options);
    document.addEventListener("scroll", end, options);
    window.addEventListener("resize", end, options);
    return () => asking.abort();
  }, [target, end]);
}

interface BubbleProps {
  id: string;
  target: HTMLElement;
  label: ReactNode;
  width: number | undefined;
}

function Bubble({ id, target, label, width }: BubbleProps) {
  const bubble = useRef<HTMLDivElement>(null);
  useLayoutEffect(() => {
    const { current: box } = bubble;
    if (box === null) return;
    const size = { width: box.offsetWidth, height: box.offsetHeight };
    const place = tooltipPlace(target.getBoundingClientRect(), size, window.innerWidth);
    box.style.left = `${place.left}px`;
    box.style.top = `${place.top}px`;
    box.style.setProperty("--arrow", `${place.arrow}px`);
    box.toggleAttribute("data-below", place.below);
  });
  return createPortal(
    <div
      ref={bubble}
      id={id}
      role="tooltip"
      className={style.bubble}
      data-wraps={width !== undefined || undefined}
      style={{ width }}
    >
      {label}
    </div>,
    document.querySelector(MENUS) ?? document.body,
  );
}

export function Tooltip({ label, disabled = false, width, onFocus = false, children }: Props) {
  const [target, setTarget] = useState<HTMLElement | null>(null);
  const id = useId();
  const timer = useRef<ReturnType<typeof setTimeout> | undefined>(undefined);
  const { current: end } = useRef(() => {
    clearTimeout(timer.current);
    setTarget(null);
  });
  useEffect(() => () => clearTimeout(timer.current), []);
  useEnd(target, end);
  const shown = disabled ? null : target;
  const { props } = children;
  const child = cloneElement(children, {
    "aria-describedby": shown === null ? props["aria-describedby"] : id,
    onPointerEnter: (event) => {
      props.onPointerEnter?.(event);
      const { currentTarget, pointerType } = event;
      if (pointerType !== "mouse") return;
      clearTimeout(timer.current);
      timer.current = setTimeout(() => setTarget(currentTarget), DELAY);
    },
    onPointerLeave: (event) => {
      props.onPointerLeave?.(event);
      end();
    },
    ...(onFocus && {
      onFocus: (event) => {
        props.onFocus?.(event);
        setTarget(event.currentTarget);
      },
      onBlur: (event) => {
        props.onBlur?.(event);
        end();
      },
    }),
  });
  return (
    <>
      {child}
      {shown !== null && <Bubble id={id} target={shown} label={label} width={width} />}
    </>
  );
}

interface TargetBox {
  readonly left: number;
  readonly top: number;
  readonly width: number;
  readonly height: number;
}

export interface TooltipPlace {
  readonly left: number;
  readonly top: number;
  /** From its left edge to the middle of its arrow. */
  readonly arrow: number;
  readonly below: boolean;
}

/** The distance to the element that it tells of, and to the window, px. */
const GAP = 7;
const MARGIN = 8;
/** Its corners are round. */
const ARROW = 8;

const between = (least: number, value: number, most: number) =>
  Math.max(least, Math.min(value, most));

/** All in px of the window. */
export function tooltipPlace(
  target: TargetBox,
  size: { readonly width: number; readonly height: number },
  windowWidth: number,
): TooltipPlace {
  const middle = target.left + target.width / 2;
  const left = between(MARGIN, middle - size.width / 2, windowWidth - size.width - MARGIN);
  const above = target.top - size.height - GAP;
  const below = above < MARGIN;
  return {
    left,
    top: below ? target.top + target.height + GAP : above,
    arrow: between(ARROW, middle - left, size.width - ARROW),
    below,
  };
}
