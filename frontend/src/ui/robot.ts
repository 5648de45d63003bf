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

export function initials(name: string): string {
  const words = name.trim().split(/\s+/);
  const letters =
    words.length > 1 ? `${words[0]?.[0]}${words.at(-1)?.[0]}` : name.trim().slice(0, 2);
  return letters.toUpperCase() || "?";
}
