/** Opens and closes lanes inside of others: one by one, and all at once. */
import { IconChevronDown, IconChevronRight } from "@tabler/icons-react";
import style from "./lane-toggle.module.css";
import type { OpenLanes } from "./use-open-lanes";

interface Props {
  /** The way to the action, in words. */
  words: string;
  /** Null: nothing is inside; the room for the sign stays. */
  opened: boolean | null;
  onOpen: () => void;
}

export function LaneToggle({ words, opened, onOpen }: Props) {
  if (opened === null) return <span className={style.toggle} />;
  return (
    <button
      type="button"
      className={style.toggle}
      aria-expanded={opened}
      aria-label={`What ran inside of ${words}`}
      onClick={onOpen}
    >
      <IconChevronRight size={14} aria-hidden />
    </button>
  );
}

interface AllLevelsProps {
  lanes: readonly { name: string; holds: boolean }[];
  inside: OpenLanes;
}

/** Nothing where no lane has others inside. */
export function AllLevels({ lanes, inside }: AllLevelsProps) {
  const holding = lanes.filter(({ holds }) => holds);
  if (holding.length === 0) return null;
  const all = holding.every(({ name }) => inside.open.has(name));
  const Icon = all ? IconChevronDown : IconChevronRight;
  return (
    <button
      type="button"
      className={style.openAll}
      aria-expanded={all}
      onClick={() => inside.set(all ? [] : holding.map(({ name }) => name))}
    >
      <Icon size={13} aria-hidden /> All levels
    </button>
  );
}
