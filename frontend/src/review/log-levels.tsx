/** The levels of the lines of an engine's log, as words with a mark, and the choice of those to list. */
import { NativeSelect } from "@mantine/core";
import type { Run } from "../api/runs";

/** "": not recorded. */
export type LogLevel = NonNullable<NonNullable<Run["log"]>[number]["level"]>;

interface Look {
  readonly word: string;
  /** Says the same without colour. */
  readonly mark: string;
  readonly rank: number;
  readonly color: string;
}

const LOOKS: Readonly<Record<LogLevel, Look>> = {
  "": { word: "level unknown", mark: "?", rank: Number.POSITIVE_INFINITY, color: "var(--ink3)" },
  debug: { word: "debug", mark: "·", rank: 0, color: "var(--ink3)" },
  info: { word: "info", mark: "i", rank: 1, color: "var(--ink2)" },
  warn: { word: "warning", mark: "△", rank: 2, color: "var(--warn)" },
  error: { word: "error", mark: "✗", rank: 3, color: "var(--error)" },
  fatal: { word: "fatal", mark: "■", rank: 4, color: "var(--error)" },
};

/** Return whether a line is listed. A line without a known level always is, as is all that is no line. */
export function isListed(level: LogLevel | undefined, least: LogLevel): boolean {
  return level === undefined || LOOKS[level].rank >= LOOKS[least].rank;
}

export function LevelWord({ level }: { level: LogLevel }) {
  const { word, mark, color } = LOOKS[level];
  return (
    <span className="nowrap weight-600" style={{ color }}>
      <span aria-hidden>{mark} </span>
      {word}
    </span>
  );
}

const CHOICES = [
  { value: "debug", label: "All levels" },
  { value: "info", label: "Info and above" },
  { value: "warn", label: "Warnings and errors" },
  { value: "error", label: "Errors" },
] as const;

interface Props {
  least: LogLevel;
  onLeast: (least: LogLevel) => void;
}

export function LevelChoice({ least, onLeast }: Props) {
  return (
    <NativeSelect
      size="xs"
      aria-label="Levels of the engine’s log"
      data={[...CHOICES]}
      value={least}
      onChange={({ currentTarget: { value } }) =>
        onLeast(CHOICES.find((each) => each.value === value)?.value ?? "debug")
      }
    />
  );
}
