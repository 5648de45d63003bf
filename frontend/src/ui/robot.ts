/** A robot's colour: stable for its name, the same for everybody. */
const COLOURS = 6;

function hash(text: string): number {
  let h = 2166136261;
  for (let i = 0; i < text.length; i += 1) h = Math.imul(h ^ text.charCodeAt(i), 16777619);
  return h >>> 0;
}

export function robotColor(name: string): string {
  return name === "" ? "var(--ink4)" : `var(--robot-${hash(name) % COLOURS})`;
}

export function personColor(id: string): string {
  return `var(--robot-${hash(id) % COLOURS})`;
}

/** A colour for each of the people in one place, each their own as long as colours last. */
export function colorsOf(ids: readonly string[]): Map<string, string> {
  const colors = new Map<string, string>();
  const taken = new Set<number>();
  for (const id of [...new Set(ids)].sort()) {
    let at = hash(id) % COLOURS;
    for (let i = 0; i < COLOURS && taken.has(at); i += 1) at = (at + 1) % COLOURS;
    taken.add(at);
    colors.set(id, `var(--robot-${at})`);
  }
  return colors;
}

export function initials(name: string): string {
  const words = name.trim().split(/\s+/);
  const letters =
    words.length > 1 ? `${words[0]?.[0]}${words.at(-1)?.[0]}` : name.trim().slice(0, 2);
  return letters.toUpperCase() || "?";
}
