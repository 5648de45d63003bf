/** How a picture is laid on paper: on one page as long as its names can be read, else on several. Pure. */

interface PageView {
  readonly x: number;
  readonly y: number;
  readonly width: number;
  readonly height: number;
}

/** What is free on a page of A4 beside its margins and the header, px of 1/96 inch. */
const ACROSS = { width: 1040, height: 600 };
const UPRIGHT = { width: 700, height: 900 };
/** Names are 13 px in the picture: smaller than 5.4 pt on paper nobody reads them. */
const SMALLEST = 0.55;
const OVERLAP = 60; // px of the picture that neighbours share
const MOST_PAGES = 40;

export interface PrintPages {
  /** Row by row. */
  readonly pages: readonly PageView[];
  /** The same on all. */
  readonly scale: number;
  /** Whether the paper lies across: upright only where that shows the picture larger. */
  readonly across: boolean;
}

/** The parts of a picture, page by page. */
export function pagesOf(width: number, height: number): PrintPages {
  const scaleOn = (paper: typeof ACROSS) => Math.min(1, paper.width / width, paper.height / height);
  const across = scaleOn(ACROSS) >= scaleOn(UPRIGHT);
  const paper = across ? ACROSS : UPRIGHT;
  const whole = scaleOn(paper);
  if (whole >= SMALLEST) return { pages: [{ x: 0, y: 0, width, height }], scale: whole, across };
  for (let scale = SMALLEST; ; scale *= 0.9) {
    const [wide, high] = [paper.width / scale, paper.height / scale];
    const columns = count(width, wide);
    const rows = count(height, high);
    if (columns * rows > MOST_PAGES) continue;
    const pages = Array.from({ length: columns * rows }, (_, i) => ({
      x: (i % columns) * (wide - OVERLAP),
      y: Math.floor(i / columns) * (high - OVERLAP),
      width: wide,
      height: high,
    }));
    return { pages, scale, across };
  }
}

/** How many pages of a length cover another one, each with a piece of that before. */
function count(length: number, page: number): number {
  return Math.max(1, Math.ceil((length - OVERLAP) / (page - OVERLAP)));
}
