/** What both sides changed: each side in words, beside each other, and whose counts. */
import { useId } from "react";
import type { DraftChoices, DraftConflict, DraftSide } from "../api/documents/drafts";
import style from "./drafts.module.css";
import { ToldChanges } from "./told-changes";

interface ConflictSideProps {
  conflict: DraftConflict;
  side: DraftSide;
  name: string;
  group: string;
  chosen: boolean;
  onChoose: () => void;
}

function Side({ conflict, side, name, group, chosen, onChoose }: ConflictSideProps) {
  return (
    <label className={style.side} data-chosen={chosen || undefined}>
      <span className={style.pick}>
        <input type="radio" name={group} checked={chosen} onChange={onChoose} />
        <bdi>{name}</bdi>
      </span>
      {conflict.removed === side ? (
        <p className={style.removed}>removed it</p>
      ) : (
        <ToldChanges changes={conflict[side]} nothing="changed it" />
      )}
    </label>
  );
}

interface Props {
  conflicts: readonly DraftConflict[];
  choices: DraftChoices;
  names: Readonly<Record<DraftSide, string>>;
  onChoose: (place: string, side: DraftSide) => void;
}

export function MergeConflicts({ conflicts, choices, names, onChoose }: Props) {
  const group = useId();
  return (
    <section aria-label="Changed on both sides">
      <h3>
        Both changed {conflicts.length === 1 ? "this" : `these ${conflicts.length}`}: whose counts?
      </h3>
      {conflicts.map((conflict) => (
        <fieldset key={conflict.place} className={style.conflict}>
          <legend>
            <bdi>{conflict.what}</bdi>
          </legend>
          <div className={style.sides}>
            {(["origin", "draft"] as const).map((side) => (
              <Side
                key={side}
                conflict={conflict}
                side={side}
                name={names[side]}
                group={`${group} ${conflict.place}`}
                chosen={choices[conflict.place] === side}
                onChoose={() => onChoose(conflict.place, side)}
              />
            ))}
          </div>
        </fieldset>
      ))}
    </section>
  );
}
