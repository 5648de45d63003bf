/**
 * d3-color without colours: the canvas moves from view to view, which is numbers only.
 *
 * React Flow brings d3-transition, which brings the names of all colours of the web and four ways to
 * mix them. What asks whether something is a colour is told no, and moves between the numbers in it.
 */

export function color(): null {
  return null;
}

function mixed(): never {
  throw new Error("Nothing on the canvas moves from one colour to another.");
}

export { mixed as cubehelix, mixed as hcl, mixed as hsl, mixed as lab, mixed as rgb };
