/**
 * A search field on the canvas: Enter adds the action and connects it to the outcome from which it
 * was opened.
 */
import { Kbd, TextInput } from "@mantine/core";
import { IconPlus, IconSearch } from "@tabler/icons-react";
import { useEffect, useId, useMemo, useRef, useState } from "react";
import { CARD } from "../../canvas/geometry/ranks";
import { OutcomeSign, outcomeColor, outcomeWord } from "../../canvas/outcome";
import {
  type AddRequest,
  addActionAt,
  type EditorContext,
} from "../../edit-actions/editor-context";
import { asOneEdit, connect, insertInto, type NewAction } from "../../graph/edit";
import type { Position } from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { keyOf } from "../../ui/keys";
import { useTypedAhead } from "../../ui/typed-ahead";
import { isolated } from "../../words/isolated";
import style from "./quick-add.module.css";

interface Props {
  context: EditorContext;
  request: AddRequest;
  known: readonly NewAction[];
  onClose: () => void;
}

const MOST = 8;

/**
 * Return the known actions that match, best first, then a new action of that name if there is none,
 * then graphs whose names contain the text, and last actions that only have it in their
 * description.
 */
export function candidates(known: readonly NewAction[], search: string): NewAction[] {
  const wanted = search.trim().toLowerCase();
  const label = ({ name, title }: NewAction) => title ?? name;
  const rank = ({ name, title = name }: NewAction) => {
    // Ready-made ones come after those of the library, unless somebody asks for them.
    if (wanted === "") return name === title ? 0 : 1;
    const words = [name.toLowerCase(), title.toLowerCase()];
    if (words.some((each) => each.startsWith(wanted))) return 0;
    return words.some((each) => each.includes(wanted)) ? 1 : 2;
  };
  const fitting = known
    .map((action) => ({ action, rank: rank(action) }))
    .filter(({ action, rank: r }) => r < 2 || action.description?.toLowerCase().includes(wanted))
    .sort((a, b) => a.rank - b.rank || label(a.action).localeCompare(label(b.action)))
    .slice(0, MOST);
  const isExact = (action: NewAction) => action.name.toLowerCase() === wanted;
  const exact = fitting.some(({ action }) => isExact(action));
  const fresh = wanted === "" || exact ? [] : [{ name: search.trim() }];
  const isFirst = (action: NewAction) => action.ofGraph === undefined || isExact(action);
  // actions that match only by their description come last
  const named = fitting.filter(({ rank: r }) => r < 2).map(({ action }) => action);
  const described = fitting.filter(({ rank: r }) => r === 2).map(({ action }) => action);
  const graphs = named.filter((action) => !isFirst(action));
  return [...named.filter(isFirst), ...fresh, ...graphs, ...described];
}

/** Return the upper left corner of the new card, null for none; an arrow leads to the middle of its input. */
function cornerOf({ graph }: EditorContext, { at, from }: AddRequest): Position | null {
  if (at === null) return null;
  const [x, y] = at;
  return from !== null && graph.direction === "right"
    ? [x, y - Math.round(CARD.height / 2)]
    : [x - Math.round(CARD.width / 2), y];
}

function placed(context: EditorContext, request: AddRequest, template: NewAction): string {
  const position = cornerOf(context, request);
  return asOneEdit(context.doc, () => {
    const key = addActionAt(context, template, position);
    if (request.from) connect(context.doc, request.from.key, key, request.from.outcome);
    if (request.into) insertInto(context.doc, request.into, key);
    return key;
  });
}

export function QuickAdd({ context, request, known, onClose }: Props) {
  const [search, setSearch] = useState("");
  const field = useRef<HTMLInputElement>(null);
  useTypedAhead(field, setSearch);
  const [at, setAt] = useState(0);
  const list = useMemo(() => candidates(known, search), [known, search]);
  const box = useRef<HTMLDivElement>(null);
  const id = useId();
  useEffect(() => {
    const onDown = (event: PointerEvent) => {
      if (!box.current?.contains(event.target as Node)) onClose();
    };
    window.addEventListener("pointerdown", onDown);
    return () => window.removeEventListener("pointerdown", onDown);
  }, [onClose]);

  const choose = (template: NewAction | undefined, byKey = false) => {
    if (!template) return;
    const key = placed(context, request, template);
    context.select([key]);
    if (byKey) context.view.focus(key);
    const at = cornerOf(context, request);
    if (at !== null) context.view.reveal(at);
    onClose();
  };
  const onKeyDown = (event: React.KeyboardEvent) => {
    const key = keyOf(event);
    if (key === "Escape") onClose();
    else if (key === "Enter") choose(list[at], true);
    else if (key === "ArrowDown") setAt((i) => Math.min(i + 1, list.length - 1));
    else if (key === "ArrowUp") setAt((i) => Math.max(i - 1, 0));
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const left = Math.max(8, Math.min(request.screen[0] - 20, window.innerWidth - 308));
  const top = Math.max(8, Math.min(request.screen[1] - 12, window.innerHeight - 380));
  const { from } = request;
  return (
    <div
      ref={box}
      className={style.box}
      style={{ left, top }}
      role="dialog"
      aria-label="Add an action"
    >
      {from && (
        <p className={style.from}>
          when {isolated(endName(context.graph, from.key))} is{" "}
          <span style={{ color: outcomeColor[from.outcome] }}>
            <OutcomeSign outcome={from.outcome} /> {outcomeWord[from.outcome]}
          </span>
          , run
        </p>
      )}
      <TextInput
        ref={field}
        autoFocus
        placeholder="Name of an action"
        leftSection={<IconSearch size={15} aria-hidden />}
        value={search}
        onChange={(event) => {
          setSearch(event.currentTarget.value);
          setAt(0);
        }}
        onKeyDown={onKeyDown}
        role="combobox"
        aria-expanded="true"
        aria-controls={id}
        aria-activedescendant={`${id}-${at}`}
        aria-label="Name of an action"
      />
      <div id={id} role="listbox" className={style.list} aria-label="Actions">
        {list.map((template, i) => {
          const isNew = !known.includes(template);
          return (
            // biome-ignore lint/a11y/useKeyWithClickEvents: keys are handled by the search field
            // biome-ignore lint/a11y/useFocusableInteractive: focus stays in the search field
            <div
              key={template.name}
              id={`${id}-${i}`}
              role="option"
              aria-selected={i === at}
              className={style.item}
              onPointerMove={() => setAt(i)}
              onClick={() => choose(template)}
            >
              <span className="row gap-4px weight-500">
                {isNew && <IconPlus size={13} aria-hidden />}
                {isNew
                  ? `New action “${isolated(template.name)}”`
                  : (template.title ?? template.name)}
              </span>
              {template.description && (
                <span className="block truncate faint-11_5">{template.description}</span>
              )}
            </div>
          );
        })}
        {list.length === 0 && <p className={style.none}>Type the name of the action.</p>}
      </div>
      <p className={style.help} data-keys>
        <Kbd>↑</Kbd> <Kbd>↓</Kbd> choose · <Kbd>Enter</Kbd> place · <Kbd>Esc</Kbd> close
      </p>
    </div>
  );
}
