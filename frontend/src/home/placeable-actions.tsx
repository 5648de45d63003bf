/**
 * List of things to place on the canvas: actions of the library, of graphs and of robots, and
 * graphs.
 */
import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconInfoCircle } from "@tabler/icons-react";
import { useMutation, useQueryClient } from "@tanstack/react-query";
import { memo, useDeferredValue, useMemo } from "react";
import { refreshLibrary } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { actionDrag } from "../canvas/action-drag";
import { type NewAction, READY_TEMPLATES } from "../graph/edit";
import { LateOpening } from "../ui/late-opening";
import { lazyPart } from "../ui/lazy-part";
import { LongList } from "../ui/long-list";
import { isolated } from "../words/isolated";
import { RowSkeletons } from "./graph-rows";
import { matchesSearch } from "./graph-selection";
import { type KnownAction, type KnownGraph, signature, usePlaceable } from "./known-actions";
import {
  type RobotAction,
  robotTemplate,
  takeFromRobot,
  useRobotsKnowledge,
} from "./robot-actions";
import style from "./sidebar.module.css";

type Place = (template: NewAction) => void;

const bare = (template: NewAction): KnownAction => ({
  template,
  document: null,
  usedIn: [],
  takes: [],
  gives: [],
});

const READY_ROWS: readonly KnownAction[] = READY_TEMPLATES.map(bare);

const fits = (search: string, template: NewAction): boolean =>
  matchesSearch(
    search,
    template.title ?? "",
    template.name,
    template.description,
    signature(template),
  );

function RobotRow({ has, onPlace }: { has: RobotAction; onPlace: Place }) {
  const client = useQueryClient();
  const { runner } = useLive();
  const take = useMutation({
    mutationFn: () => takeFromRobot(runner, has),
    onError: (error) =>
      notifications.show({ color: "red", title: "Not taken over", message: errorText(error) }),
    onSettled: () => refreshLibrary(client),
  });
  return (
    <div className={style.onRobot}>
      <ActionRow known={bare(robotTemplate(has.action))} onPlace={onPlace} />
      <Button
        size="compact-xs"
        variant="subtle"
        loading={take.isPending}
        onClick={() => take.mutate()}
      >
        Take over
        <span className="visually-hidden">
          {" "}
          {isolated(has.action.name)} from <bdi>{has.robot}</bdi>
        </span>
      </Button>
    </div>
  );
}

/** Lists actions that robots have and that neither the library nor a graph knows. */
function OnRobots({ search, known, onPlace }: RobotsProps) {
  const { byName } = useRobotsKnowledge();
  const found = [...byName.values()].flatMap(([has]) =>
    has && !known.has(has.action.name) && fits(search, robotTemplate(has.action)) ? [has] : [],
  );
  if (found.length === 0) return null;
  return (
    <>
      <div className={style.heading}>
        <h2>Only on robots</h2>
      </div>
      {found.map((has) => (
        <RobotRow key={has.action.name} has={has} onPlace={onPlace} />
      ))}
    </>
  );
}

interface RobotsProps {
  search: string;
  known: ReadonlySet<string>;
  onPlace: Place;
}

/** The ready-made actions, which no robot carries out. */
function ReadyMade({ search, onPlace }: { search: string; onPlace: Place }) {
  const found = READY_ROWS.filter(({ template }) => fits(search, template));
  if (found.length === 0) return null;
  return (
    <section aria-label="Ask people, or wait">
      <div className={style.heading}>
        <h2>Ask people, or wait</h2>
      </div>
      <p className={style.how}>No robot carries these out: a led run asks people, or waits.</p>
      {found.map((known) => (
        <ActionRow key={known.template.name} known={known} onPlace={onPlace} />
      ))}
    </section>
  );
}

/** The other graphs, each as one action that runs all of it. */
function Graphs({ graphs, onPlace }: { graphs: readonly KnownGraph[]; onPlace: Place }) {
  const { robots, unknown, graphs: indexed } = useRobotsKnowledge();
  if (graphs.length === 0) return null;
  const on = (name: string) => {
    const having = indexed.get(name);
    if (having !== undefined) return `on ${having.map(isolated).join(", ")}`;
    // One that has not told what it has may have it.
    return robots.length === 0 || unknown.length > 0 ? "" : "on no robot";
  };
  return (
    <section aria-label="Graphs as actions">
      <div className={style.heading}>
        <h2>Graphs</h2>
      </div>
      <p className={style.how}>
        Each is one action that runs a whole graph, on robots that have indexed it.
      </p>
      {graphs.map(({ graph, template }) => (
        <ActionRow key={graph} known={bare(template)} note={on(template.name)} onPlace={onPlace} />
      ))}
    </section>
  );
}

const Rows = memo(function Rows({ actions, onPlace }: ActionRowsProps) {
  return (
    <LongList rowHeight={2.94}>
      {actions.map((known) => (
        <ActionRow key={known.template.name} known={known} onPlace={onPlace} />
      ))}
    </LongList>
  );
});

interface ActionRowsProps {
  actions: readonly KnownAction[];
  onPlace: Place;
}

interface Props {
  search: string;
  /** The graph on the canvas. */
  current: string | undefined;
  onPlace: Place;
}

export function PlaceableActions({ search: typed, current, onPlace }: Props) {
  const { actions, graphs, ready } = usePlaceable(current);
  // Typing is never held up by the list.
  const search = useDeferredValue(typed);
  const shown = useMemo(
    () => actions.filter(({ template }) => fits(search, template)),
    [actions, search],
  );
  const others = graphs.filter(({ template }) => fits(search, template));
  const fresh = search.trim();
  const exact = [...shown, ...others].some(({ template }) => template.name === fresh);
  if (!ready) return <RowSkeletons count={4} />;
  return (
    <>
      <p className={style.how}>Drag or tap to place.</p>
      <Rows actions={shown} onPlace={onPlace} />
      {fresh !== "" && !exact && <ActionRow known={bare({ name: fresh })} onPlace={onPlace} />}
      {shown.length === 0 && fresh === "" && (
        <p className={style.hint}>
          Actions appear here once a graph uses them. Type a name above to make a new one.
        </p>
      )}
      <OnRobots
        search={search}
        known={new Set(actions.map(({ template }) => template.name))}
        onPlace={onPlace}
      />
      <Graphs graphs={others} onPlace={onPlace} />
      <ReadyMade search={search} onPlace={onPlace} />
    </>
  );
}

const ActionFacts = lazyPart(() => import("./action-facts").then((part) => part.ActionFacts));

function About({ known }: { known: KnownAction }) {
  return (
    <LateOpening opens="menu" part={(button) => <ActionFacts button={button} known={known} />}>
      <button
        type="button"
        className={style.about}
        aria-label={`About ${isolated(known.template.name)}`}
      >
        <IconInfoCircle size={15} aria-hidden />
      </button>
    </LateOpening>
  );
}

interface ActionRowProps {
  known: KnownAction;
  /** Text after its parameters. */
  note?: string;
  onPlace: (template: NewAction) => void;
}

// There may be a thousand: while somebody types, those that stay are not drawn again.
export const ActionRow = memo(function ActionRow({ known, note = "", onPlace }: ActionRowProps) {
  const { template, usedIn } = known;
  return (
    <div className={style.action}>
      <button
        type="button"
        className={style.row}
        title={template.description || template.name}
        onPointerDown={(event) => actionDrag.press(event, template, template.name)}
        onClick={() => onPlace(template)}
      >
        <span className={style.grip} aria-hidden />
        <span className="fill">
          <span className={style.name}>{template.title ?? template.name}</span>
          <span className={style.sub}>
            {signature(template)}
            {usedIn.length > 0 && ` · used in ${usedIn.length}`}
            {note !== "" && ` · ${note}`}
          </span>
        </span>
      </button>
      {usedIn.length > 0 && <About known={known} />}
    </div>
  );
});
