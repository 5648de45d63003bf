/**
 * Lists reasons why sub-graphs would behave differently in one graph, each with a link to the
 * action it is about.
 */
import type { FlatteningReason } from "../api/inside";
import type { EditorContext } from "../edit-actions/editor-context";
import style from "./levels.module.css";

/** The number of actions or reasons that are listed. */
export const MOST = 100;

type LevelWay = NonNullable<FlatteningReason["at"]>;
/** Return the full names of the actions on a way, such as `Outer_0 › Inner_0`. */
export const wayWords = (way: LevelWay): string => way.map(({ action }) => action).join(" › ");

interface Props {
  context: EditorContext;
  reasons: readonly FlatteningReason[];
  /** Shortens the way to an action that is shown; by default it is shown whole. */
  told?: (way: LevelWay) => LevelWay;
  label: string;
  onClose: () => void;
}

export function ReasonList({ context, reasons, told = (way) => way, label, onClose }: Props) {
  const show = (way: LevelWay) => {
    const [first] = way;
    if (first === undefined) return;
    onClose();
    context.select([first.key]);
    context.view.show([first.key]);
  };
  return (
    <ul className={style.list} aria-label={label}>
      {reasons.slice(0, MOST).map((reason) => {
        const way = told(reason.at ?? []);
        const words = wayWords(way);
        return (
          <li key={`${reason.code} ${words} ${reason.message}`}>
            {words !== "" && (
              <button
                type="button"
                className="button-bare ink-accent weight-600"
                onClick={() => show(way)}
              >
                <bdi>{words}</bdi>
              </button>
            )}
            <span>{reason.message}</span>
          </li>
        );
      })}
    </ul>
  );
}
