/** Before a start: where it goes, what was looked at there, and exactly what will be sent. */
import { Button, Checkbox, Modal, Text, Textarea } from "@mantine/core";
import { IconPlayerPlayFilled, IconRefresh } from "@tabler/icons-react";
import { keepPreviousData, useQuery } from "@tanstack/react-query";
import { type ReactNode, useMemo, useState } from "react";
import { Link } from "wouter";
import { identifiedText } from "../../api/courses";
import { useVersions } from "../../api/graphs";
import { errorText } from "../../api/http";
import { fetchInside } from "../../api/inside";
import { CONDUCTED, type LedOrder } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { useMay, usePerson } from "../../api/people";
import { useRight } from "../../api/rights";
import { type Preflight, type Robot, SIMULATOR, useRosReach } from "../../api/robots";
import type { Run, Watching } from "../../api/runs";
import { runPreflight, type StartFrom, type StartValues } from "../../api/starts";
import { fromUmrf } from "../../canvas/from-umrf";
import type { RunBreakpoint } from "../../graph/breakpoints";
import { isReadyMade, rolesIn } from "../../graph/questions";
import { type Beginning, beginningWords } from "../../status/earlier-list";
import { HelpLink } from "../../status/help-link";
import { batonWords } from "../../status/robot-rights";
import { SecondPerson, WantedYes } from "../../status/second-person";
import { askingRobots, ConfirmFirst } from "../../status/start-remedies";
import { EngineLabel } from "../../status/state-label";
import { lineWords, valueLines } from "../../status/value-words";
import { useWatching, WatchTicks } from "../../status/watching";
import { startScope, useKeptText } from "../../ui/kept-texts";
import { colorOfName } from "../../ui/name-colors";
import { counted } from "../../words/counted";
import { isolated } from "../../words/isolated";
import { useAskedValues, ValueList } from "./asked-values";
import {
  actionsInside,
  actorsIn,
  castObstacle,
  castOf,
  LedChoice,
  LevelsChoice,
  movesWords,
  PeopleChoice,
  WayChoice,
} from "./led-choice";
import { PreflightList } from "./preflight-list";
import { mayWait, QueueOffer } from "./queue-choice";
import { useOpenRepeat, useRepeatChoice } from "./repeat-choice";
import { sameVersion } from "./same-version";
import { useAllBreakpoints, useBreakpoints } from "./start-breakpoints";
import { StartButton } from "./start-button";
import style from "./start-dialog.module.css";
import { useStartFrom } from "./start-from";
import { lastLed, rememberEngines, rememberLed, useStart } from "./use-start";

interface Props {
  graph: string;
  name: string;
  seq: number;
  label: string;
  chosen: readonly string[];
  /** The engine of each actor, if a led run is started once more. */
  robots?: LedOrder["robots"] | null | undefined;
  /** Values to begin with: of the run that is started once more. */
  values?: StartValues | undefined;
  /** Set if the run that is started once more had opened its sub-graphs, false if not. */
  opens?: boolean;
  /** The place where it begins, if not at the entry. */
  beginning?: Beginning | undefined;
  onChosen: (engines: string[]) => void;
  onStarted?: (runs: readonly Run[]) => void;
  onClose: () => void;
}

const LOOK_AGAIN = 5_000; // ms

/** The text of the moment. */
function useText(graph: string, seq: number) {
  return useQuery({
    queryKey: ["umrf", graph, seq],
    queryFn: ({ signal }) => identifiedText(graph, seq, signal),
    staleTime: Number.POSITIVE_INFINITY,
  });
}

/** Query the graphs inside of a moment, for the actors of their actions. */
function useInside(graph: string, seq: number) {
  return useQuery({
    queryKey: ["inside", graph, seq],
    queryFn: ({ signal }) => fetchInside(graph, seq, signal),
    staleTime: 0,
  });
}

/** Query the state of the chosen engines, as the runner sees it now. */
function useLook(
  { graph, seq, umrf }: { graph: string; seq: number; umrf: string | undefined },
  engines: readonly string[],
  behaviours: boolean,
  led: LedOrder | null,
  said: {
    watching: Watching;
    drill: boolean;
    breakpoints: readonly RunBreakpoint[] | undefined;
    values: StartValues | null;
    from: StartFrom | undefined;
  },
) {
  const { runner } = useLive();
  const look = useQuery({
    queryKey: ["preflight", graph, seq, behaviours, led, said, ...engines],
    queryFn: async ({ signal }) => {
      const inside = await fetchInside(graph, seq, signal);
      const what = { graph, umrf: umrf ?? "", ...inside };
      const { breakpoints = [] } = said;
      const { from, ...others } = said;
      const all = { ...others, breakpoints, values: said.values ?? {}, ...(from && { from }) };
      return runPreflight(runner ?? "", what, engines, behaviours, led, all, signal);
    },
    enabled:
      umrf !== undefined &&
      runner !== undefined &&
      engines.length > 0 &&
      said.breakpoints !== undefined &&
      said.values !== null,
    refetchInterval: LOOK_AGAIN,
    gcTime: 0,
    staleTime: 0,
    retry: false,
    // The questions stay while another answer to them is looked at.
    ...(said.from && { placeholderData: keepPreviousData }),
  });
  const lookSoon = () => void look.refetch({ cancelRefetch: false });
  return { look, lookSoon, error: look.error };
}

/** The simulator goes alone; robots go together. */
function toggled(engines: readonly string[], name: string): string[] {
  if (name === SIMULATOR) return [SIMULATOR];
  const robots = engines.filter((engine) => engine !== SIMULATOR);
  const left = robots.filter((engine) => engine !== name);
  return left.length < robots.length ? left : [...robots, name].sort();
}

interface ChoiceProps {
  robot: Robot;
  on: boolean;
  may: boolean;
  /** Its actions do what people have written in Python, whatever that is. */
  behaviours: boolean;
  onToggle: () => void;
}

function Choice({ robot, on, may, behaviours, onToggle }: ChoiceProps) {
  const off = !robot.simulated && (!may || robot.state === "no_link");
  return (
    <label className={style.choice} data-on={on || undefined} data-off={off || undefined}>
      <input
        type={robot.simulated ? "radio" : "checkbox"}
        checked={on}
        disabled={off}
        onChange={onToggle}
      />
      <i className={style.stripe} style={{ background: colorOfName(robot.name) }} aria-hidden />
      <span className="fill ellipsis weight-550">{robot.simulated ? "Simulator" : robot.name}</span>
      {robot.simulated ? (
        <span className="quiet-xs">
          {behaviours ? "its Python code can move things" : "nothing moves"}
        </span>
      ) : (
        <EngineLabel robot={robot} />
      )}
      {!robot.simulated && !may && <span className="quiet-xs">operators only</span>}
      {!robot.simulated && may && <RightWords robot={robot} />}
    </label>
  );
}

/** Says in a few words what keeps a start from a robot; the look says it in whole sentences. */
function RightWords({ robot }: { robot: Robot }) {
  const { person } = usePerson();
  const why = useRight(robot.name)?.why ?? "";
  const words =
    robot.locks.length > 0
      ? "OUT OF SERVICE"
      : robot.baton
        ? batonWords(robot, person.id)
        : why === ""
          ? ""
          : why === robot.drill_due
            ? "a Stop drill is due"
            : "you may not start here";
  return words === "" ? null : (
    <span className={why === "" ? "quiet-xs" : "quiet-xs ink-warn"} title={why}>
      {words}
    </span>
  );
}

interface WhereProps {
  engines: readonly string[];
  behaviours: boolean;
  onToggle: (name: string) => void;
}

function Where(props: WhereProps) {
  const { now } = useLive();
  const may = useMay("operate");
  return (
    <fieldset className={style.where}>
      <legend>Where</legend>
      {now.engines.map((robot) => (
        <Choice
          key={robot.name}
          robot={robot}
          on={props.engines.includes(robot.name)}
          may={may}
          behaviours={props.behaviours}
          onToggle={() => props.onToggle(robot.name)}
        />
      ))}
      {now.engines.every((robot) => robot.simulated) && (
        <Text size="sm" c="dimmed">
          No robot is registered. <Link to="/robots">Robots</Link> explains how to register one, and
          how to practise without one.
        </Text>
      )}
    </fieldset>
  );
}

function Exactly({
  name,
  label,
  digest,
  engines,
  moves,
  values,
  same,
}: {
  name: string;
  label: string;
  /** The name of an earlier version with the same graph; "" for none. */
  same: string;
  digest: string;
  engines: readonly string[];
  /** The robots that move in a led run; "" for other starts. */
  moves: string;
  values: StartValues | null;
}) {
  return (
    <dl className={style.exactly}>
      <dt className="ink2">Graph</dt>
      <dd>{name}</dd>
      <dt className="ink2">Version</dt>
      <dd title={digest}>
        {label}
        {same !== "" && <span className="quiet-xs">, the same graph as {same}</span>}
      </dd>
      <dt className="ink2">{engines.length > 1 ? "Robots" : "On"}</dt>
      <dd>{engines.map(isolated).join(", ") || "nowhere yet"}</dd>
      {moves !== "" && (
        <>
          <dt className="ink2">Moves</dt>
          <dd>{moves}</dd>
        </>
      )}
      <ValueList values={values} />
    </dl>
  );
}

/** Return whether a Stop drill has to be made before the next start there. */
function isDrillDue({ items }: Preflight): boolean {
  return items.some(({ code, verdict }) => code === "drill" && verdict === "blocked");
}

/** Return why nothing can be started now; null when it can. */
function obstacleOf(
  engines: readonly string[],
  looks: readonly Preflight[] | undefined,
  reason: string,
): string | null {
  if (engines.length === 0) return "Choose where";
  if (looks === undefined) return "Looking …";
  if (askingRobots(looks).length > 0) return "Confirm that it is you first";
  if (looks.some((look) => look.never)) return "A check prevents the start";
  const codes = looks.flatMap((look) => look.override);
  if (codes.length > 0 && reason.trim() === "") return "Say why to start anyway";
  return null;
}

/** The way in which a graph is started, and the robots of a led start. */
function useWay({ graph, seq, chosen, robots, opens: wished, beginning }: Props) {
  const { now } = useLive();
  const may = useMay("operate");
  const text = useText(graph, seq);
  const marks = useBreakpoints(graph, seq);
  const inside = useInside(graph, seq);
  // Without an answer only the actors of the graph itself are known; the look says what is missing.
  const graphs = inside.isPending ? null : inside.data?.subgraphs;
  const actors = useMemo(() => actorsIn(text.data, graphs), [text.data, graphs]);
  const [before] = useState(() => lastLed(graph));
  const [picked, pick] = useState<LedOrder["robots"]>(robots ?? before?.robots ?? {});
  const [lost, setLost] = useState<LedOrder["lost"]>(before?.lost ?? "stop");
  const several = actors.filter((actor) => actor !== "").length > 1;
  // No engine asks people or waits: such a graph is led.
  const own = useMemo(
    () => (text.data ? fromUmrf(JSON.parse(text.data)).actions : []),
    [text.data],
  );
  const asks = own.some(isReadyMade);
  const [wanted, want] = useState<boolean | null>(chosen.includes(CONDUCTED) ? true : null);
  const mayLead = now.engines.some((robot) => robot.led);
  const waits = (marks.data?.length ?? 0) > 0;
  const continues = beginning?.at.length === 0;
  const led = continues || asks || (wanted ?? (several || waits));
  const offered = !continues && !asks && (several || waits || led || mayLead);
  const cast = castOf(actors, picked, now.engines, may);
  const [wish, setOpens] = useState(wished ?? before?.levels === "opened");
  const mayOpen = led && beginning === undefined && (graphs?.length ?? 0) > 0;
  const opened = mayOpen && wish;
  const opens = opened || beginning?.opened !== undefined;
  const every = useAllBreakpoints(marks.data, graph, seq, opens, beginning?.opened);
  const roles = useMemo(
    () => rolesIn(opened ? [...own, ...actionsInside(graphs)] : own),
    [own, opened, graphs],
  );
  const [answering, setAnswering] = useState<LedOrder["people"]>(before?.people);
  const people = Object.fromEntries(roles.map((role) => [role, answering?.[role] ?? ""]));
  const needsNone = actors.length === 0 && asks && graphs !== null;
  const missing = led && !needsNone ? castObstacle(actors, cast) : null;
  const wrong = text.error ?? marks.error ?? every.error;
  const { breakpoints } = every;
  const way = { text, wrong, breakpoints, actors, several, led, want, offered };
  const levels = { mayOpen, opened, setOpens };
  return { ...way, ...levels, cast, pick, lost, setLost, missing, roles, people, setAnswering };
}

export function StartDialog(props: Props) {
  const { graph, name, seq, label, chosen, beginning, onChosen, onStarted, onClose } = props;
  const [whole, setEngines] = useState<readonly string[]>(() => {
    const robots = chosen.filter((engine) => engine !== CONDUCTED);
    return robots.length > 0 ? robots : [SIMULATOR];
  });
  const way = useWay(props);
  const { led, cast } = way;
  const order: LedOrder | null = led
    ? {
        ...{ robots: cast, lost: way.lost },
        ...(way.roles.length > 0 && { people: way.people }),
        ...(way.opened && { levels: "opened" as const }),
      }
    : null;
  const players = [...new Set(Object.values(cast))].sort();
  const engines = led ? players : whole;
  const asked = led ? (way.missing === null ? [CONDUCTED] : []) : whole;
  const { person } = usePerson();
  // A reason counts for this moment on these robots only.
  const place = `${startScope(graph, person.id)}start/${seq}/${led ? "led/" : ""}${engines.join("/")}`;
  const [reason, setReason] = useKeptText(place);
  const { now } = useLive();
  const { behaviours, choice } = useBehaviours(!led && engines.includes(SIMULATOR));
  const moment = { graph, seq, umrf: way.text.data };
  const watch = useWatching(engines);
  const mayDrill = !led && engines.length === 1 && !engines.includes(SIMULATOR);
  const [drills, setDrills] = useState(false);
  const { breakpoints } = way;
  const { from, ...begins } = useStartFrom(
    beginning,
    `${startScope(graph, person.id)}continue/${beginning?.run ?? ""}`,
  );
  const place_ = beginning && { run: beginning.run, at: [...beginning.at], only: beginning.only };
  const given = useAskedValues(graph, way.text.data, props.values, () => setReason(""), place_);
  // A run is continued with its own values.
  const values = beginning?.at.length === 0 ? (props.values ?? {}) : given.values;
  const said = { watching: watch.watching, drill: drills && mayDrill, breakpoints, values, from };
  const { look, lookSoon, error: lookError } = useLook(moment, asked, behaviours, order, said);
  const error = way.wrong ?? given.error ?? lookError;
  const start = useStart(graph);
  const mayMove = engines.some((engine) => engine !== SIMULATOR);
  const repeats = useRepeatChoice(given.asked, mayMove, `${startScope(graph, person.id)}repeat`);
  const open = useOpenRepeat(graph);
  const mayRepeat = beginning === undefined && asked.length === 1 && !said.drill;
  const repeat = mayRepeat ? repeats.order : null;
  const looks = look.data;
  const earlier = looks?.find((each) => each.earlier)?.earlier;
  const codes = [...new Set((looks ?? []).flatMap((each) => each.override))];
  const { digest = "", tree_digest: tree } = looks?.find((each) => each.digest !== "") ?? {};
  const same = sameVersion(useVersions(graph).data ?? [], { digest, tree, seq });
  const why =
    now.link === "down"
      ? "The runner does not answer"
      : start.isPending || open.isPending
        ? "Starting …"
        : (way.missing ??
          given.obstacle ??
          watch.obstacle ??
          begins.obstacle(earlier) ??
          (repeat && repeats.obstacle) ??
          (look.isPlaceholderData
            ? "Looking …"
            : obstacleOf(led ? asked : engines, looks, reason)));
  const choose = (engine: string) => {
    setReason("");
    setDrills(false);
    setEngines(toggled(whole, engine));
  };
  const override = codes.length > 0 ? { override: { codes, reason: reason.trim() } } : {};
  const sent = {
    seq,
    engines: asked,
    ...(order && { led: order }),
    digest,
    ...(tree && { tree }),
    behaviours,
    ...said,
    breakpoints: breakpoints ?? [],
    values: values ?? {},
  };
  const waitObstacle =
    beginning || said.drill
      ? "A start like this cannot wait"
      : (way.missing ??
        given.obstacle ??
        (look.isPlaceholderData || breakpoints === undefined ? "Looking …" : null));
  const begin = () => {
    rememberEngines(graph, asked);
    if (order !== null) rememberLed(graph, order);
    onChosen([...asked]);
    const done = ({ runs }: { runs: readonly Run[] }) => {
      setReason("");
      begins.forget();
      onClose();
      onStarted?.(runs);
    };
    // Whoever starts says each time that they watch, and that it is for a drill.
    const onSettled = () => {
      watch.forget();
      setDrills(false);
    };
    if (repeat !== null) {
      const opened = () => {
        repeats.forget();
        done({ runs: [] });
      };
      open.mutate({ ...sent, ...override, repeat }, { onSuccess: opened });
      return;
    }
    start.mutate({ ...sent, ...override }, { onSuccess: done, onSettled });
  };
  // Of a part only some robots are looked at: those of the others are not needed.
  const moving = beginning && looks ? engines.filter((each) => isLooked(looks, each)) : engines;
  const where = moving.map((engine) => (engine === SIMULATOR ? "the simulator" : engine));
  const how = led ? ", step by step," : "";
  const moves = moving.some((engine) => engine !== SIMULATOR);
  const verb = moves ? "Start" : "Run";
  const at = moves ? `on ${where.map(isolated).join(", ")}` : "in the simulator";
  const what = repeat
    ? `Repeat ${isolated(label)}${how} ${at}: ${counted(repeats.count, "run")}`
    : `${verb} ${isolated(label)}${how} ${at}`;
  return (
    <Modal
      opened
      onClose={onClose}
      title={`${beginning ? `${beginningWords(beginning)}:` : "Start"} ${isolated(label)} of ${isolated(name)}`}
      closeButtonProps={{ "aria-label": "Close" }}
      size="lg"
    >
      {way.offered && (
        <WayChoice
          led={led}
          several={way.several}
          onLed={(wanted) => {
            setReason("");
            setDrills(false);
            way.want(wanted);
          }}
        />
      )}
      {led ? (
        <LedChoice
          actors={beginning?.at.length === 0 ? [] : way.actors}
          cast={cast}
          lost={way.lost}
          onCast={(robots) => {
            setReason("");
            way.pick(robots);
          }}
          onLost={way.setLost}
        />
      ) : (
        <Where engines={engines} behaviours={behaviours} onToggle={choose} />
      )}
      {way.mayOpen && (
        <LevelsChoice
          opened={way.opened}
          onOpened={(opened) => {
            setReason("");
            way.setOpens(opened);
          }}
        />
      )}
      {way.roles.length > 0 && (
        <PeopleChoice roles={way.roles} people={way.people} onPeople={way.setAnswering} />
      )}
      {choice}
      {begins.part(earlier)}
      {given.form(lookError)}
      {mayRepeat && repeats.part}
      <WatchTicks watch={watch} />
      {asked.length > 0 && (
        <section
          className={style.looks}
          aria-label="Checks before the start"
          aria-busy={look.isFetching}
        >
          <header className={style.lookHead}>
            <h3>Before the start</h3> <HelpLink place="operators-guide.html#before-a-start" />
            <Button
              size="compact-xs"
              variant="subtle"
              leftSection={<IconRefresh size={13} aria-hidden />}
              onClick={() => void look.refetch()}
            >
              Look again
            </Button>
          </header>
          {error !== null && (
            <Text size="sm" c="var(--error)" role="alert">
              {errorText(error)}
            </Text>
          )}
          {given.isIncomplete && (
            <Text size="sm" className="ink3">
              It is looked at as soon as all values are given.
            </Text>
          )}
          {!given.isIncomplete &&
            (led ? [CONDUCTED, ...moving.filter((each) => each !== SIMULATOR)] : engines).map(
              (engine) => (
                <PreflightList
                  key={engine}
                  engine={engine}
                  alone={!led && engines.length === 1}
                  look={looks?.find((each) => each.engine === engine)}
                  moment={{ graph, seq, onLeave: onClose, onLookAgain: lookSoon }}
                />
              ),
            )}
        </section>
      )}
      {mayDrill && (drills || looks?.some(isDrillDue)) && (
        <Checkbox
          checked={drills}
          onChange={(event) => setDrills(event.currentTarget.checked)}
          label="This start is for a Stop drill: I press Stop while it moves"
        />
      )}
      <SecondPerson
        key={asked.join("/")}
        graph={graph}
        seq={seq}
        label={label}
        looks={looks}
        values={values ?? {}}
        taken={given.taken}
      />
      <WantedYes graph={graph} looks={looks} />
      <ConfirmFirst looks={looks} />
      <footer className={style.foot}>
        {codes.length > 0 && (mayWait(looks) || !looks?.some(({ never }) => never)) && (
          <Textarea
            label="Why start anyway? It is recorded with the run."
            value={reason}
            maxLength={500}
            autosize
            minRows={1}
            className={style.way ?? ""}
            onChange={(event) => setReason(event.currentTarget.value)}
          />
        )}
        {repeat === null && (
          <QueueOffer
            graph={graph}
            wanted={sent}
            looks={looks}
            robots={engines}
            obstacle={waitObstacle}
            reason={reason}
            onSent={onClose}
          />
        )}
        <Exactly
          name={name}
          label={label}
          digest={digest}
          engines={moving}
          moves={led && way.missing === null ? movesWords(castFor(cast, moving)) : ""}
          values={values}
          same={same}
        />
        <StartButton
          icon={<IconPlayerPlayFilled size={13} aria-hidden />}
          label={why ?? (moves && !repeat ? "Hold to start" : what)}
          name={why === null ? what : `${verb} ${label}: ${why}`}
          question={
            moves && !repeat
              ? `Start exactly ${isolated(label)} of ${isolated(name)}${how} on ${where.map(isolated).join(", ")}${withWords(values)}?${led ? ` ${movesWords(castFor(cast, moving))}` : ""}`
              : null
          }
          disabled={why !== null}
          onStart={begin}
        />
      </footer>
    </Modal>
  );
}

/** Return whether the look names an engine; the simulator of a led run has no look of its own. */
function isLooked(looks: readonly Preflight[], engine: string): boolean {
  return engine === SIMULATOR || looks.some((look) => look.engine === engine);
}

/** Return the actors that these engines play. */
function castFor(cast: LedOrder["robots"], engines: readonly string[]): LedOrder["robots"] {
  return Object.fromEntries(Object.entries(cast).filter(([, name]) => engines.includes(name)));
}

/** Return the values of a start as the end of a question. */
function withWords(values: StartValues | null): string {
  const lines = valueLines(values ?? {}).map((line) => isolated(lineWords(line)));
  return lines.length === 0 ? "" : `, with ${listed(lines)}`;
}

const NAMED = 6;

function listed(names: readonly string[]): string {
  const more = names.length - NAMED;
  return names.slice(0, NAMED).join(", ") + (more > 0 ? ` and ${more} more` : "");
}

function BehavioursChoice(props: { on: boolean; onChange: (on: boolean) => void }) {
  const { runner } = useLive();
  const there = useRosReach(runner).data?.behaviours ?? null;
  if (there === null) return null;
  const refused = Object.values(there.refused);
  return (
    <fieldset className={style.where}>
      <legend>What actions do</legend>
      <label className={style.choice} data-on={!props.on || undefined}>
        <input
          type="radio"
          name="behaviours"
          checked={!props.on}
          onChange={() => props.onChange(false)}
        />
        <span className="fill ellipsis weight-550">Simulated</span>
        <span className="quiet-xs">each takes a second and succeeds</span>
      </label>
      <label className={style.choice} data-on={props.on || undefined}>
        <input
          type="radio"
          name="behaviours"
          checked={props.on}
          onChange={() => props.onChange(true)}
        />
        <span className="fill ellipsis weight-550">Python behaviours</span>
        <span className="quiet-xs">{listed(there.names) || "none yet"}</span>
      </label>
      {(there.problem !== "" || refused.length > 0) && (
        <Text size="sm" c="dimmed">
          {[there.problem, ...refused].join(" ").trim()}
        </Text>
      )}
    </fieldset>
  );
}

/**
 * Return whether Python behaviours were chosen, with the control to choose them; both empty unless
 * an engine is simulated.
 */
export function useBehaviours(simulated: boolean): { behaviours: boolean; choice: ReactNode } {
  const [chosen, choose] = useState(false);
  const choice = simulated ? <BehavioursChoice on={chosen} onChange={choose} /> : null;
  return { behaviours: chosen && simulated, choice };
}
