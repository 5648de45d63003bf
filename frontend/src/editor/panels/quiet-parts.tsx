/** Parts that say more of what is drawn. They come last, and whoever cannot have one misses nothing else. */
import { type ComponentType, useEffect, useState } from "react";

const levels = () => import("../../levels/levels").then((part) => part.Levels);
const sinceMarks = () => import("../../past/since/since-marks").then((part) => part.SinceMarks);

const lostDrafts = () => import("./lost-drafts").then((part) => part.LostDrafts);

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
  return (
    <>
      <QuietPart load={levels} />
      <QuietPart load={sinceMarks} />
      <QuietPart load={lostDrafts} />
    </>
  );
}
