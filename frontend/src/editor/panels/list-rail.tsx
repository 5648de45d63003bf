/** The rail to which the lists are folded; each of its buttons opens a list over the canvas. */
import { ActionIcon } from "@mantine/core";
import {
  IconAlertTriangle,
  IconBolt,
  IconHistory,
  IconLayoutSidebarLeftExpand,
  IconListTree,
  IconSitemap,
} from "@tabler/icons-react";
import { type MouseEvent, type ReactNode, useEffect, useRef } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import type { ProblemGroup } from "../../graph/problems/problem-groups";
import { countsOf, countWords } from "../../graph/problems/problem-kinds";
import { whenThere } from "../../ui/focus-field";
import { type ListTab, useListTab } from "../../ui/hooks";
import { keyOf } from "../../ui/keys";
import { Tooltip } from "../../ui/tooltip";
import { isolated } from "../../words/isolated";
import style from "./list-rail.module.css";
import { type EditorSidePanel, ENTRY_BUTTON, type Panels, ROW } from "./use-panels";

const PARTS = [
  {
    name: "Graphs",
    side: "library",
    tab: "graphs",
    icon: IconSitemap,
    changes: false,
    field: "[data-search]",
  },
  {
    name: "Actions",
    side: "library",
    tab: "actions",
    icon: IconBolt,
    changes: true,
    field: "[data-search]",
  },
  { name: "Outline", side: "outline", tab: null, icon: IconListTree, changes: false, field: ROW },
  {
    name: "History",
    side: "history",
    tab: null,
    icon: IconHistory,
    changes: false,
    field: ENTRY_BUTTON,
  },
] as const;

type Part = (typeof PARTS)[number];

/** Closes an open list by Escape or a press on the canvas. `opener`: the element that gets the focus back. */
function usePutAway(open: boolean, putAway: () => void, opener: () => HTMLElement | null) {
  const now = useRef({ putAway, opener });
  now.current = { putAway, opener };
  useEffect(() => {
    if (!open) return;
    const inside = ({ target }: Event, where: string) =>
      target instanceof Element && target.closest(where) !== null;
    const onKey = (event: KeyboardEvent) => {
      if (keyOf(event) !== "Escape" || !inside(event, "[data-list]")) return;
      event.preventDefault();
      now.current.putAway();
      now.current.opener()?.focus();
    };
    const onPress = (event: PointerEvent) => {
      if (inside(event, ".react-flow")) now.current.putAway();
    };
    window.addEventListener("keydown", onKey, { capture: true });
    window.addEventListener("pointerdown", onPress, { capture: true });
    return () => {
      window.removeEventListener("keydown", onKey, { capture: true });
      window.removeEventListener("pointerdown", onPress, { capture: true });
    };
  }, [open]);
}

interface RailButtonProps {
  name: string;
  icon: ReactNode;
  /** True if its list is open; undefined for a button that opens no list. */
  open?: boolean;
  /** Text after the name, such as counts. */
  more?: string;
  onPress: (event: MouseEvent) => void;
}

function RailButton({ name, icon, open, more, onPress }: RailButtonProps) {
  const words = more ? `${isolated(name)}: ${more}` : name;
  return (
    <Tooltip label={words}>
      <button
        type="button"
        className={style.part}
        aria-label={words}
        aria-expanded={open}
        data-part={name}
        onClick={onPress}
      >
        {icon}
        <span aria-hidden>{name}</span>
      </button>
    </Tooltip>
  );
}

function ProblemsButton({ told }: { told: readonly ProblemGroup[] }) {
  const { setPanel } = useEditorContext();
  const counts = countsOf(told);
  const { wrong, fillIn, warnings } = counts;
  return (
    <RailButton
      name="Problems"
      more={countWords(counts).join(", ")}
      onPress={() => setPanel("problems")}
      icon={
        <span className={style.counted}>
          <IconAlertTriangle size={19} />
          {wrong + fillIn + warnings > 0 && (
            <span className={style.counts}>
              {wrong > 0 && <b data-kind="wrong">{wrong}</b>}
              {fillIn > 0 && <b data-kind="fill-in">{fillIn}</b>}
              {warnings > 0 && <b data-kind="warning">{warnings}</b>}
            </span>
          )}
        </span>
      }
    />
  );
}

interface Props {
  panels: Panels;
  told: readonly ProblemGroup[];
}

export function ListRail({ panels, told }: Props) {
  const { left, setLeft, side, setSide, fold } = panels;
  const { mayEdit } = useEditorContext();
  const rail = useRef<HTMLElement>(null);
  const [tab, setTab] = useListTab();
  const current = sideName(side, mayEdit ? tab : "graphs");
  usePutAway(
    left,
    () => setLeft(false),
    () => rail.current?.querySelector<HTMLElement>(`[data-part="${current}"]`) ?? null,
  );
  const press = (part: Part, byKey: boolean) => {
    if (left && current === part.name) {
      setLeft(false);
      return;
    }
    if (part.tab !== null) setTab(part.tab);
    setSide(part.side);
    setLeft(true);
    if (byKey) whenThere(part.field, (field) => field.focus({ preventScroll: true }));
  };
  return (
    <nav ref={rail} className={style.rail} aria-label="Lists" data-list>
      {PARTS.filter(({ changes }) => mayEdit || !changes).map((part) => (
        <RailButton
          key={part.name}
          name={part.name}
          icon={<part.icon size={19} aria-hidden />}
          open={left && current === part.name}
          // a click by key has a click count of 0
          onPress={(event) => press(part, event.detail === 0)}
        />
      ))}
      <ProblemsButton told={told} />
      <Tooltip label="Unfold the list">
        <ActionIcon
          className={style.unfold ?? ""}
          size={44}
          aria-label="Unfold the list"
          onClick={() => {
            fold(false);
            whenThere("[data-fold-list]", (button) => button.focus());
          }}
        >
          <IconLayoutSidebarLeftExpand size={19} />
        </ActionIcon>
      </Tooltip>
    </nav>
  );
}

/** Return the name of the open list. */
function sideName(side: EditorSidePanel, tab: ListTab): Part["name"] {
  if (side === "outline") return "Outline";
  if (side === "history") return "History";
  return tab === "actions" ? "Actions" : "Graphs";
}
