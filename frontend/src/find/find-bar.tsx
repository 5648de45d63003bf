/** Find in graph: a line to type in, hits below it, next and previous, all by keyboard. */
import { ActionIcon, Kbd, TextInput } from "@mantine/core";
import {
  IconArrowRight,
  IconChevronDown,
  IconChevronUp,
  IconSearch,
  IconSquareRounded,
  IconX,
} from "@tabler/icons-react";
import { useDeferredValue, useEffect, useId, useMemo, useRef, useState } from "react";
import type { Problem } from "../api/graphs";
import { printedKeys } from "../edit-actions/edit-action";
import { useEditorContext } from "../edit-actions/editor-context";
import { keyOf } from "../ui/keys";
import { Tooltip } from "../ui/tooltip";
import { useWatched } from "../ui/watched";
import { find, findInside, type Hit } from "./find";
import style from "./find-bar.module.css";

const MOST = 200;

interface Props {
  problems: readonly Problem[];
  onClose: () => void;
}

interface FoundProps {
  id: string;
  hit: Hit;
  current: boolean;
  onChoose: () => void;
}

function Found({ id, hit, current, onChoose }: FoundProps) {
  return (
    // biome-ignore lint/a11y/useKeyWithClickEvents: the keys are those of the field
    <div
      id={id}
      className={style.hit}
      role="option"
      tabIndex={-1}
      aria-selected={current}
      onClick={onChoose}
    >
      {hit.kind === "action" ? (
        <IconSquareRounded size={14} aria-hidden />
      ) : (
        <IconArrowRight size={14} aria-hidden />
      )}
      <span className={style.text}>
        <b>{hit.title}</b>
        {hit.why !== "" && <span className="block break-anywhere ink2 text-75">{hit.why}</span>}
      </span>
    </div>
  );
}

function Steps({ disabled, onStep }: { disabled: boolean; onStep: (step: 1 | -1) => void }) {
  return (
    <>
      <Tooltip label="Previous (Shift Enter)">
        <ActionIcon aria-label="Previous hit" disabled={disabled} onClick={() => onStep(-1)}>
          <IconChevronUp size={16} />
        </ActionIcon>
      </Tooltip>
      <Tooltip label="Next (Enter)">
        <ActionIcon aria-label="Next hit" disabled={disabled} onClick={() => onStep(1)}>
          <IconChevronDown size={16} />
        </ActionIcon>
      </Tooltip>
    </>
  );
}

export function FindBar({ problems, onClose }: Props) {
  const context = useEditorContext();
  const [query, setQuery] = useState("");
  const [at, setAt] = useState(0);
  const asked = useDeferredValue(query);
  const expanded = useWatched(context.store.expanded);
  const hits = useMemo(
    () => [
      ...find(context.graph, problems, asked),
      ...findInside(context.graph, expanded?.partsOf, asked),
    ],
    [context.graph, problems, asked, expanded],
  );
  const field = useRef<HTMLInputElement>(null);
  const list = useRef<HTMLDivElement>(null);
  const before = useRef<Element | null>(null);
  const id = useId();
  const current = Math.min(at, hits.length - 1);
  useEffect(() => {
    before.current = document.activeElement;
    field.current?.focus();
  }, []);
  useEffect(() => {
    list.current?.querySelector('[aria-selected="true"]')?.scrollIntoView({ block: "nearest" });
  });
  const go = (index: number) => {
    const hit: Hit | undefined = hits[(index + hits.length) % Math.max(1, hits.length)];
    if (hit === undefined) return;
    setAt(hits.indexOf(hit));
    // A hit on a card with a graph in it is shown at that card.
    context.select([hit.id.split("/")[0] ?? hit.id]);
    context.view.show(hit.keys);
  };
  const close = () => {
    onClose();
    const { current: old } = before;
    if (old instanceof HTMLElement) old.focus();
  };
  const onKey = (event: React.KeyboardEvent) => {
    const key = keyOf(event);
    const step = { ArrowDown: 1, ArrowUp: -1, Enter: event.shiftKey ? -1 : 1 }[key];
    if (key === "Escape") close();
    else if (step !== undefined) {
      // The first Enter goes to the first hit, later ones on.
      const fresh = !context.selection.has(hits[current]?.id.split("/")[0] ?? "");
      go(fresh ? current : current + step);
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const none = asked.trim() !== "" && hits.length === 0;
  return (
    <search className={style.bar} aria-label="Find in graph" data-find-bar>
      <div className={style.row}>
        <TextInput
          ref={field}
          className="fill"
          aria-label="Find in graph"
          placeholder="Name, robot, value …"
          leftSection={<IconSearch size={15} aria-hidden />}
          role="combobox"
          aria-expanded={hits.length > 0}
          aria-controls={`${id}-hits`}
          aria-activedescendant={hits.length > 0 ? `${id}-${current}` : ""}
          value={query}
          onChange={(event) => {
            setQuery(event.currentTarget.value);
            setAt(0);
          }}
          onKeyDown={onKey}
        />
        <span className={style.count} role="status">
          {hits.length > 0 ? `${current + 1} of ${hits.length}` : none ? "None" : ""}
        </span>
        <Steps disabled={hits.length === 0} onStep={(step) => go(current + step)} />
        <ActionIcon aria-label="Close the search" onClick={close}>
          <IconX size={16} />
        </ActionIcon>
      </div>
      <div
        className={style.hits}
        role="listbox"
        aria-label="Found"
        id={`${id}-hits`}
        ref={list}
        hidden={hits.length === 0}
      >
        {hits.slice(0, MOST).map((hit, i) => (
          <Found
            key={hit.id}
            id={`${id}-${i}`}
            hit={hit}
            current={i === current}
            onChoose={() => go(i)}
          />
        ))}
      </div>
      {none && (
        <p className={style.none}>
          Nothing matches. <code>robot:</code>, <code>type:</code>, <code>parameter:</code>,{" "}
          <code>problem:</code> search in one field only.
        </p>
      )}
      {query === "" && (
        <p className={style.none}>
          <Kbd>Enter</Kbd> next, <Kbd>{printedKeys("Shift+Enter").join(" ")}</Kbd> previous,{" "}
          <Kbd>Esc</Kbd> closes
        </p>
      )}
    </search>
  );
}
