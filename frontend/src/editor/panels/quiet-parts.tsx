/** Parts that say more of what is drawn. They come last, and whoever cannot have one misses nothing else. */
import { type ComponentType, useEffect, useState } from "react";

const LOADS: readonly (() => Promise<ComponentType>)[] = [
  () => import("../../levels/levels").then((part) => part.Levels),
  () => import("../../past/since/since-marks").then((part) => part.SinceMarks),
];

function QuietPart({ load }: { load: () => Promise<ComponentType> }) {
  const [Part, setPart] = useState<ComponentType | null>(null);
  useEffect(() => {
    let gone = false;
    load().then(
      (part) => !gone && setPart(() => part),
      () => {},
    );
    return () => {
      gone = true;
    };
  }, [load]);
  return Part === null ? null : <Part />;
}

export function QuietParts() {
  // biome-ignore lint/suspicious/noArrayIndexKey: they never change places
  return LOADS.map((load, i) => <QuietPart key={i} load={load} />);
}
