/** Which lanes are open, so that what ran inside of them is seen; none is at first. */
import { useCallback, useMemo, useState } from "react";

export interface OpenLanes {
  /** By the names of their actions. */
  readonly open: ReadonlySet<string>;
  readonly toggle: (name: string) => void;
  readonly set: (names: readonly string[]) => void;
}

export function useOpenLanes(): OpenLanes {
  const [open, setOpen] = useState<ReadonlySet<string>>(new Set());
  const toggle = useCallback(
    (name: string) =>
      setOpen((before) => {
        const now = new Set(before);
        if (!now.delete(name)) now.add(name);
        return now;
      }),
    [],
  );
  const set = useCallback((names: readonly string[]) => setOpen(new Set(names)), []);
  return useMemo(() => ({ open, toggle, set }), [open, toggle, set]);
}
