/** A field that several people may write in: who has the caret there, and what is wrong there. */
import { IconAlertTriangle } from "@tabler/icons-react";
import { type FocusEvent, type ReactNode, use, useEffect, useRef } from "react";
import { onePerId, PersonSign } from "../../people/people";
import { useEditors, usePersonColors, useRoom } from "../../sync/use-room";
import { ProblemsContext, problemsAt } from "./field-problems";
import style from "./shared-field.module.css";

interface Props {
  /** The key of the action, the id of the arrow, or `graph`. */
  of: string;
  field: string;
  children: ReactNode;
}

const WRITABLE = "input, textarea, [contenteditable=true]";

export function SharedField({ of, field, children }: Props) {
  const { presence } = useRoom();
  const id = `${of}|${field}`;
  const here = useRef(false);
  const leave = useRef(() => {});
  leave.current = () => {
    if (here.current) presence.tell({ editing: undefined });
    here.current = false;
  };
  const come = (event: FocusEvent) => {
    if (!event.target.matches(WRITABLE)) return;
    here.current = true;
    presence.tell({ editing: id });
  };
  // A field that goes while the caret is in it says nothing by itself.
  useEffect(() => () => leave.current(), []);
  return (
    // biome-ignore lint/a11y/noStaticElementInteractions: only hears of the field inside
    <div className={style.field} onFocus={come} onBlur={() => leave.current()}>
      {children}
      <Writers id={id} />
      <Wrong of={of} field={field} />
    </div>
  );
}

/** What is wrong here; the whole sentence stands above the form too. */
function Wrong({ of, field }: { of: string; field: string }) {
  const here = problemsAt(use(ProblemsContext), of, field);
  const [worst] = here;
  if (worst === undefined) return null;
  return (
    <p className={style.wrong} data-severity={worst.severity}>
      <IconAlertTriangle size={12} aria-hidden />
      <span title={here.map(({ message }) => message).join("\n")}>
        {[...new Set(here.map(({ code }) => code))].join(", ")}
        <span className="visually-hidden">: {here.map(({ message }) => message).join(" ")}</span>
      </span>
    </p>
  );
}

function Writers({ id }: { id: string }) {
  const writers = onePerId(useEditors(id));
  return writers.length === 0 ? null : <Signs writers={writers} />;
}

function Signs({ writers }: { writers: ReturnType<typeof useEditors> }) {
  const colorOf = usePersonColors();
  return (
    <span className={style.signs}>
      {writers.map((writer) => (
        <PersonSign key={writer.client} person={writer} color={colorOf(writer.id)} />
      ))}
    </span>
  );
}
