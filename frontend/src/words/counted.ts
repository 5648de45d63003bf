/** Return a number with its noun, such as `1 graph` and `3 graphs`. */
export const counted = (count: number, noun: string): string =>
  `${count} ${noun}${count === 1 ? "" : "s"}`;
