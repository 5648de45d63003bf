/** Return a text without the marks that isolate the names in it, as people read it. */
export const plain = (text: string | null | undefined): string =>
  (text ?? "").replace(/[\u2066-\u2069]/g, "");
