/** What was changed, in words, or that nothing was. */
import type { MergePreview } from "../api/documents/drafts";
import { ChangeLines } from "../past/entry-row";
import style from "./drafts.module.css";

const MOST = 12; // lines

type ToldMerge = MergePreview["changes"];

export const isNothing = ({ fields, actions, relations, notes }: ToldMerge): boolean =>
  [fields, actions, relations, notes].every((each) => (each?.length ?? 0) === 0);

interface Props {
  changes: ToldMerge;
  /** Where nothing is told. */
  nothing: string;
}

export function ToldChanges({ changes, nothing }: Props) {
  if (isNothing(changes)) return <p className={style.quiet}>{nothing}</p>;
  return (
    <div className={style.told}>
      <ChangeLines changes={changes} most={MOST} />
    </div>
  );
}
