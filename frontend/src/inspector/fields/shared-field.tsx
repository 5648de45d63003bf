/** A field that several people may write in: who has the caret there, and what is said of it. */
import { type FocusEvent, type ReactNode, use, useEffect, useRef } from "react";
import { onePerId, PersonSign } from "../../people/people";
import { useEditors, usePersonColors, useRoom } from "../../sync/use-room";
import { DraftOwnerContext } from "../../ui/drafts";
import { groupsAt, ProblemsContext } from "./field-problems";
import { ProblemNote } from "./problem-note";
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
  const told = groupsAt(use(ProblemsContext), of, field);
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
    <div
      className={style.field}
      data-field={id}
      data-kind={told[0]?.kind}
      onFocus={come}
      onBlur={() => leave.current()}
    >
      <DraftOwnerContext value={of}>{children}</DraftOwnerContext>
      <Writers id={id} />
      {told.map((each) => (
        <ProblemNote key={each.id} told={each} />
      ))}
    </div>
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
