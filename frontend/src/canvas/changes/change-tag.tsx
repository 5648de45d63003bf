/** Above what came, went or changed between two moments: the sign of that, and whose it was. */
import { CHANGE_SIGNS, type ChangeMark } from "./change-marks";
import style from "./change-tag.module.css";

/** `beside`: there is another tag at its place. */
export function ChangeTag({ mark, beside = false }: { mark: ChangeMark; beside?: boolean }) {
  const { change, by } = mark;
  return (
    <span className={style.tag} data-change={change} data-beside={beside || undefined}>
      <i aria-hidden>{CHANGE_SIGNS[change]}</i>
      {by === null ? (
        change
      ) : (
        <>
          <span className="visually-hidden">{change} by </span>
          <bdi>{by}</bdi>
        </>
      )}
    </span>
  );
}

/** In the pill of an arrow: the sign alone. */
export function ChangeSign({ mark: { change } }: { mark: ChangeMark }) {
  return (
    <b className={style.sign} data-change={change}>
      <span aria-hidden>{CHANGE_SIGNS[change]}</span>
      <span className="visually-hidden">{change}</span>
    </b>
  );
}
