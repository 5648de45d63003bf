/** Parameters that are one thing for people: points, vectors, poses. Pure. */
import { segmentsOf } from "../document-keys";
import type { Parameter } from "../model";
import { readValue } from "./data-flow";

/** Numbers that stand in one row, with the letter of each. */
export interface NumberRow {
  /** The common beginning of the paths, with the slash at its end. */
  readonly prefix: string;
  readonly members: readonly { readonly letter: string; readonly parameter: Parameter }[];
}

/** One thing in a list of parameters: a single one, a group of rows, or a group of anything. */
export type ParameterBlock =
  | { readonly kind: "single"; readonly parameter: Parameter }
  | {
      readonly kind: "rows";
      readonly prefix: string;
      readonly word: string;
      readonly rows: readonly NumberRow[];
    }
  | { readonly kind: "group"; readonly prefix: string; readonly members: readonly Parameter[] };

const parentOf = (path: string): string => path.slice(0, path.lastIndexOf("/") + 1);
const LETTERS = new Set(["x", "y", "z", "w", "r", "p", "roll", "pitch", "yaw", "theta"]);
const MOST_IN_ROW = 4;

/** Members as a row; null where they are anything else than a few numbers with the names of axes. */
function rowOf(prefix: string, members: readonly Parameter[]): NumberRow | null {
  if (members.length < 2 || members.length > MOST_IN_ROW) return null;
  const letters = members.map(({ path }) => segmentsOf(path).at(-1) ?? "");
  const fits = members.every((member, i) => {
    const { native, allowed } = readValue(member);
    return native === "number" && allowed.length === 0 && LETTERS.has(letters[i] ?? "");
  });
  if (!fits) return null;
  return {
    prefix,
    members: members.map((parameter, i) => ({ letter: letters[i] ?? "", parameter })),
  };
}

const POSE_PARTS = new Set([
  "position",
  "orientation",
  "rotation",
  "translation",
  "linear",
  "angular",
]);

function wordOf(rows: readonly NumberRow[]): string {
  const [first, ...others] = rows;
  const part = segmentsOf(first?.prefix.slice(0, -1) ?? "").at(-1) ?? "";
  if (others.length > 0) return part === "linear" || part === "angular" ? "twist" : "pose";
  const letters = first?.members.map(({ letter }) => letter).join("") ?? "";
  if (letters === "xyzw") return "quaternion";
  return letters === "xy" || letters === "xyz" ? "point" : "vector";
}

interface Neighbours {
  readonly prefix: string;
  readonly members: Parameter[];
}

/** Splits a list into runs of neighbours with the same prefix. */
function runsOf(list: readonly Parameter[]): Neighbours[] {
  const runs: Neighbours[] = [];
  for (const parameter of list) {
    const prefix = parentOf(parameter.path);
    const last = runs.at(-1);
    if (last && last.prefix === prefix) last.members.push(parameter);
    else runs.push({ prefix, members: [parameter] });
  }
  return runs;
}

/** Returns the prefix of the whole that a row belongs to: a pose has its rows one level deeper. */
function ownerOf({ prefix }: NumberRow): string {
  const path = prefix.slice(0, -1);
  const last = segmentsOf(path).at(-1) ?? "";
  return POSE_PARTS.has(last) && path.includes("/") ? parentOf(path) : prefix;
}

/** A list of parameters as people see it, in its order. */
export function blocksOf(list: readonly Parameter[]): ParameterBlock[] {
  const blocks: ParameterBlock[] = [];
  for (const { prefix, members } of runsOf(list)) {
    const row = prefix === "" ? null : rowOf(prefix, members);
    const last = blocks.at(-1);
    if (row !== null) {
      const owner = ownerOf(row);
      if (last?.kind === "rows" && last.prefix === owner && owner !== prefix) {
        const rows = [...last.rows, row];
        blocks[blocks.length - 1] = { ...last, rows, word: wordOf(rows) };
      } else blocks.push({ kind: "rows", prefix: owner, word: wordOf([row]), rows: [row] });
    } else if (prefix === "") {
      for (const parameter of members) blocks.push({ kind: "single", parameter });
    } else blocks.push({ kind: "group", prefix, members });
  }
  return blocks;
}

/** Returns the name of the group of a path: `grip` for `grip/position/x`; the path itself where it is in no row. */
export function groupOf(list: readonly Parameter[], path: string): string {
  for (const block of blocksOf(list)) {
    if (block.kind === "rows" && path.startsWith(block.prefix)) return block.prefix.slice(0, -1);
  }
  return path;
}
