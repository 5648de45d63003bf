/** Completes links in notes: offers names of actions below the field after `[[` is typed. */
import { Portal } from "@mantine/core";
import { type RefObject, use, useEffect, useId, useMemo, useRef, useState } from "react";
import { linkText, type OpenLink, openLink } from "../../graph/note-links";
import { keyOf } from "../../ui/keys";
import { matching, OptionList, optionId } from "../../ui/pick-list";
import style from "./link-completion.module.css";
import { NoteLinksContext } from "./note-buttons";

const MOST = 50; // options
const GAP = 4; // px
const LOW = 240; // px; with less room below the field, the list opens above it

/** The open list of names, and the index of the selected one. */
interface Offer extends OpenLink {
  readonly options: ReturnType<typeof matching>;
  readonly chosen: number;
}

/** Inserts a link as if it had been typed, so that the field gets an input event. */
function write(field: HTMLTextAreaElement, { at }: OpenLink, name: string): void {
  const caret = field.selectionEnd;
  const link = linkText(field.value, caret, name);
  const length = field.value.length - (link.end - at) + link.text.length;
  if (field.maxLength >= 0 && length > field.maxLength) return;
  field.setRangeText(link.text, at, link.end, "end");
  field.dispatchEvent(new Event("input", { bubbles: true }));
}

/** Return the list with the selection moved; it wraps around at both ends. */
function turned(offer: Offer, by: number): Offer {
  const count = offer.options.length;
  return { ...offer, chosen: (offer.chosen + by + count) % count };
}

/** Handles the keys of the list before the field gets them; Escape closes only the list. */
function useKeys(
  field: RefObject<HTMLTextAreaElement | null>,
  offer: Offer | null,
  set: (offer: Offer | null) => void,
  take: (name: string | undefined) => void,
): void {
  const now = useRef({ offer, set, take });
  now.current = { offer, set, take };
  useEffect(() => {
    const area = field.current;
    if (area === null) return;
    const onKey = (event: KeyboardEvent) => {
      const { offer, set, take } = now.current;
      if (offer === null || event.ctrlKey || event.metaKey) return;
      const key = keyOf(event);
      if (key === "ArrowDown") set(turned(offer, 1));
      else if (key === "ArrowUp") set(turned(offer, -1));
      else if (key === "Escape") set(null);
      else if ((key === "Enter" || key === "Tab") && !event.shiftKey) {
        take(offer.options[offer.chosen]?.id);
      } else return;
      event.preventDefault();
      event.stopPropagation(); // the field would end the editing and discard the text
    };
    area.addEventListener("keydown", onKey);
    return () => area.removeEventListener("keydown", onKey);
  }, [field]);
}

/** Opens and closes the list as the text changes; it closes when the caret moves elsewhere. */
function useOffer(field: RefObject<HTMLTextAreaElement | null>) {
  const links = use(NoteLinksContext);
  const [offer, setOffer] = useState<Offer | null>(null);
  const now = useRef({ links, offer });
  now.current = { links, offer };
  useEffect(() => {
    const area = field.current;
    if (area === null) return;
    const open = () =>
      area.selectionStart === area.selectionEnd ? openLink(area.value, area.selectionEnd) : null;
    const onInput = () => {
      const link = open();
      if (link === null) return setOffer(null);
      const names = now.current.links?.names() ?? [];
      const found = matching(
        names.map((name) => ({ id: name, label: name })),
        link.typed,
      );
      const options = found.slice(0, MOST);
      setOffer(options.length === 0 ? null : { ...link, options, chosen: 0 });
    };
    const onCaret = () => {
      const { offer } = now.current;
      if (offer === null || document.activeElement !== area) return;
      const link = open();
      if (link?.at !== offer.at || link.typed !== offer.typed) setOffer(null);
    };
    const onBlur = () => setOffer(null);
    if (document.activeElement === area) onInput(); // the person may have typed before this module was loaded
    area.addEventListener("input", onInput);
    area.addEventListener("blur", onBlur);
    document.addEventListener("selectionchange", onCaret);
    return () => {
      area.removeEventListener("input", onInput);
      area.removeEventListener("blur", onBlur);
      document.removeEventListener("selectionchange", onCaret);
    };
  }, [field]);
  return [offer, setOffer] as const;
}

/**
 * Tells screen readers which name is selected. A field of several lines cannot have the role of a
 * combobox, so it keeps its role and gets the attributes.
 */
function useSaid(field: RefObject<HTMLTextAreaElement | null>, id: string, offer: Offer | null) {
  const chosen = offer === null ? null : optionId(id, offer.chosen);
  useEffect(() => {
    const area = field.current;
    if (area === null) return;
    area.setAttribute("aria-autocomplete", "list");
    area.setAttribute("aria-haspopup", "listbox");
    if (chosen === null) {
      area.removeAttribute("aria-controls");
      area.removeAttribute("aria-activedescendant");
    } else {
      area.setAttribute("aria-controls", id);
      area.setAttribute("aria-activedescendant", chosen);
    }
  }, [field, id, chosen]);
}

/** Return the place of the list in px on screen: below the field, or above it where there is more room. */
function placeAt(field: HTMLTextAreaElement): React.CSSProperties {
  const { left, top, bottom } = field.getBoundingClientRect();
  const height = window.visualViewport?.height ?? window.innerHeight;
  const x = Math.max(GAP, Math.min(left, window.innerWidth - LOW - 2 * GAP));
  return height - bottom < LOW && top > height - bottom
    ? { left: x, bottom: window.innerHeight - top + GAP }
    : { left: x, top: bottom + GAP };
}

export function LinkCompletion({ field }: { field: RefObject<HTMLTextAreaElement | null> }) {
  const id = useId();
  const [offer, setOffer] = useOffer(field);
  const take = (name: string | undefined) => {
    if (offer !== null && field.current !== null && name !== undefined) {
      write(field.current, offer, name);
    }
    setOffer(null);
  };
  useKeys(field, offer, setOffer, take);
  useSaid(field, id, offer);
  // Anew with what is typed: the field may have grown by it.
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  const place = useMemo(() => field.current && placeAt(field.current), [field, offer?.typed]);
  if (offer === null || place === null) return null;
  return (
    <Portal>
      {/* biome-ignore lint/a11y/noStaticElementInteractions: what is pressed here is no press on the note */}
      {/* biome-ignore lint/a11y/useKeyWithClickEvents: see above */}
      <div
        className={style.list}
        style={place}
        onMouseDown={(event) => event.preventDefault()} // the caret stays in the field
        onClick={(event) => event.stopPropagation()}
        onDoubleClick={(event) => event.stopPropagation()}
      >
        <OptionList
          id={id}
          label="Actions to link to"
          options={offer.options}
          at={offer.chosen}
          onPoint={(chosen) => setOffer({ ...offer, chosen })}
          onPick={({ id }) => take(id)}
        />
      </div>
    </Portal>
  );
}
