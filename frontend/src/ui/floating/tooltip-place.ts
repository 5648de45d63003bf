/** Where a tooltip stands: above what it tells of, below where there is no room, within the window. */

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

/** To what it tells of, and to the window, px. */
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
