/** The choices of a start that the runner leads step by step: who plays whom, and what a lost robot causes. */
import { NativeSelect, Text } from "@mantine/core";
import type { ReactNode } from "react";
import { Link } from "wouter";
import type { LedOrder } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { useMay } from "../../api/people";
import { useEntitled } from "../../api/rights";
import { type Robot, SIMULATOR } from "../../api/robots";
import type { Inside } from "../../api/runs";
import { fromUmrf } from "../../canvas/from-umrf";
import type { Action } from "../../graph/model";
import { isReadyMade } from "../../graph/questions";
import { robotCounts } from "../../graph/robots";
import { NOTHING_MOVES } from "../../status/watching";
import { colorOfName } from "../../ui/name-colors";
import { isolated } from "../../words/isolated";
import style from "./led-choice.module.css";
import dialogStyle from "./start-dialog.module.css";

type Cast = LedOrder["robots"];

/** Return the actions that robots play. */
const real = (actions: readonly Action[]) =>
  actions.filter((action) => !action.missing && !isReadyMade(action));

/** Return the actions of the graphs inside. */
export function actionsInside(inside: Inside["subgraphs"] | null): Action[] {
  return (inside ?? []).flatMap(
    ({ umrf }) => fromUmrf(typeof umrf === "string" ? JSON.parse(umrf) : umrf).actions,
  );
}

/**
 * Return the actors of a graph, "" (actions that name none) last; empty while its text, or the graphs
 * inside, are not there. An action that stands for a graph has the actors of the actions inside; one of
 * these that names none has the actor of the action around it.
 */
export function actorsIn(umrf: string | undefined, inside: Inside["subgraphs"] | null): string[] {
  if (umrf === undefined || inside === null) return [];
  const graphs = new Map(
    (inside ?? []).map((each) => {
      const text = each.umrf;
      return [each.name, fromUmrf(typeof text === "string" ? JSON.parse(text) : text).actions];
    }),
  );
  // Each graph is read once for each actor around it: levels that double would be endless otherwise.
  const read = new Set<string>();
  const played = (action: Action, around: string): string[] => {
    const actor = action.actor || around;
    const within = graphs.get(action.name);
    if (within === undefined) return [actor];
    const place = JSON.stringify([action.name, actor]);
    if (read.has(place)) return [];
    read.add(place);
    return real(within).flatMap((each) => played(each, actor));
  };
  const actors = real(fromUmrf(JSON.parse(umrf)).actions).flatMap((action) => {
    read.clear();
    const found = played(action, "");
    return found.length > 0 ? found : [action.actor];
  });
  return robotCounts(actors.map((actor) => ({ actor, missing: false }))).map(([actor]) => actor);
}

/** Return why a robot can play nobody in a led run; "" if it can. */
export function whyOff(robot: Robot, may: boolean): string {
  if (robot.simulated) return "";
  if (!robot.led) return "led runs are off";
  if (!may) return "operators only";
  return robot.state === "no_link" ? "no link" : "";
}

/**
 * Return the robot of each actor: what was chosen, else the robot of the same name; the simulator
 * where no robot allows led runs. An actor without a robot is left out.
 */
export function castOf(
  actors: readonly string[],
  chosen: Cast,
  engines: readonly Robot[],
  may: boolean,
): Record<string, string> {
  const can = new Set(engines.filter((robot) => whyOff(robot, may) === "").map(({ name }) => name));
  const onlySimulated = [...can].every((name) => name === SIMULATOR);
  const cast: Record<string, string> = {};
  for (const actor of actors) {
    const own = Object.hasOwn(chosen, actor) ? chosen[actor] : undefined;
    const wanted = [own, actor, onlySimulated ? SIMULATOR : undefined];
    const found = wanted.find((name) => name !== undefined && can.has(name));
    if (found !== undefined) cast[actor] = found;
  }
  return cast;
}

/** Return the name of an actor in the table; `only`: there is no other. */
function actorWords(actor: string, only: boolean): string {
  if (actor !== "") return isolated(actor);
  return only ? "All actions" : "The other actions";
}

/** Return why a led run has no complete cast; null when it has. */
export function castObstacle(actors: readonly string[], cast: Cast): string | null {
  if (actors.length === 0) return "Looking …";
  const without = actors.find((actor) => !Object.hasOwn(cast, actor));
  if (without === undefined) return null;
  return `Choose who plays ${actorWords(without, actors.length === 1).replace(/^[AT](ll|he) /, (a) => a.toLowerCase())}`;
}

/** Return what moves in a led run, and for how long, as a sentence. */
export function movesWords(cast: Cast): string {
  const engines = [...new Set(Object.values(cast))].sort();
  const robots = engines.filter((name) => name !== SIMULATOR).map(isolated);
  if (robots.length === 0) return NOTHING_MOVES;
  const rest = engines.length > robots.length ? " The simulator plays the others." : "";
  const many = robots.length > 1 ? `${robots.slice(0, -1).join(", ")} and ` : "";
  return `${many}${robots.at(-1)} may begin to move at any time until the run ends.${rest}`;
}

interface WayProps {
  led: boolean;
  /** Actions name two or more robots. */
  several: boolean;
  onLed: (led: boolean) => void;
}

/** The choice between a graph that is handed over whole and one that is led. */
export function WayChoice({ led, several, onLed }: WayProps) {
  const ways = [
    {
      value: false,
      name: "Hand over the whole graph",
      means: several
        ? "The engine gets the whole graph at once. For a graph of several robots, only the simulator can do that."
        : "The robot gets the whole graph at once and carries it out by itself. It goes on even if this server or the network fails.",
    },
    {
      value: true,
      name: "Lead it step by step",
      means:
        "The runner sends each robot one action at a time, and sees each result. If this server or the network fails, nothing further begins; what was begun goes on.",
    },
  ];
  return (
    <fieldset className={dialogStyle.where}>
      <legend>How</legend>
      {ways.map(({ value, name, means }) => (
        <label key={name} className={dialogStyle.choice} data-on={led === value || undefined}>
          <input type="radio" name="way" checked={led === value} onChange={() => onLed(value)} />
          <span className="fill">
            <span className="weight-550">{name}</span>
            <span className={style.means}>{means}</span>
          </span>
        </label>
      ))}
    </fieldset>
  );
}

interface LevelsChoiceProps {
  opened: boolean;
  onOpened: (opened: boolean) => void;
}

/** The choice between sub-graphs that are one step each, and the actions inside as steps. */
export function LevelsChoice({ opened, onOpened }: LevelsChoiceProps) {
  const ways = [
    [false, "One step each: a robot gets the whole sub-graph at once"],
    [true, "Opened: each action inside is a step of its own"],
  ] as const;
  return (
    <fieldset className={style.part}>
      <legend>Sub-graphs</legend>
      <div className={style.lost}>
        {ways.map(([value, words]) => (
          <label key={words} className="finger">
            <input
              type="radio"
              name="levels"
              checked={opened === value}
              onChange={() => onOpened(value)}
            />
            {words}
          </label>
        ))}
      </div>
    </fieldset>
  );
}

interface LedChoiceProps {
  /** Empty where the robots cannot be chosen. */
  actors: readonly string[];
  cast: Cast;
  lost: LedOrder["lost"];
  onCast: (cast: Cast) => void;
  onLost: (lost: LedOrder["lost"]) => void;
}

const LOST = [
  ["stop", "Stop everything"],
  ["wait", "Wait for a person"],
] as const;

export function LedChoice({ actors, cast, lost, onCast, onLost }: LedChoiceProps) {
  const { now } = useLive();
  const may = useMay("operate");
  const options = now.engines.map((robot) => {
    const why = whyOff(robot, may);
    const player = robot.simulated ? "Simulator, nothing moves" : isolated(robot.name);
    return {
      value: robot.name,
      label: why === "" ? player : `${player}: ${why}`,
      disabled: why !== "",
    };
  });
  // Where only the simulator plays nobody can be lost.
  const moves = Object.values(cast).some((player) => player !== SIMULATOR);
  const off = now.engines.filter(({ led, simulated }) => !simulated && !led);
  return (
    <>
      <fieldset className={style.part} hidden={actors.length === 0}>
        <legend>Who plays whom</legend>
        <div className={style.cast}>
          {actors.map((actor) => (
            <CastRow key={actor} actor={actor} only={actors.length === 1}>
              <NativeSelect
                aria-label={`Robot for ${actorWords(actor, actors.length === 1)}`}
                value={cast[actor] ?? ""}
                data={[{ value: "", label: "Choose …", disabled: true }, ...options]}
                onChange={(event) => onCast({ ...cast, [actor]: event.currentTarget.value })}
              />
            </CastRow>
          ))}
        </div>
        {off.length > 0 && (
          <Text size="xs" c="dimmed">
            Led runs are off for {off.map(({ name }) => isolated(name)).join(", ")}:{" "}
            <Link to="/robots">Robots</Link>, Change …, switches them on.
          </Text>
        )}
      </fieldset>
      {moves && (
        <fieldset className={style.part}>
          <legend>When a robot does not answer, or its action cannot begin</legend>
          <div className={style.lost}>
            {LOST.map(([value, words]) => (
              <label key={value} className="finger">
                <input
                  type="radio"
                  name="lost"
                  checked={lost === value}
                  onChange={() => onLost(value)}
                />
                {words}
              </label>
            ))}
          </div>
        </fieldset>
      )}
    </>
  );
}

interface PeopleChoiceProps {
  /** The roles that the graph asks. */
  roles: readonly string[];
  people: Readonly<Record<string, string>>;
  onPeople: (people: Readonly<Record<string, string>>) => void;
}

/** The choice of who answers for each role. */
export function PeopleChoice({ roles, people, onPeople }: PeopleChoiceProps) {
  const known = useEntitled();
  const options = [...known.groups, ...known.people].map(({ id, name }) => ({
    value: id,
    label: isolated(name || "Guest"),
  }));
  return (
    <fieldset className={style.part}>
      <legend>Who answers</legend>
      <div className={style.cast}>
        {roles.map((role) => (
          <CastRow key={role} actor={role} only={false}>
            <NativeSelect
              aria-label={`Who answers for ${isolated(role)}`}
              value={people[role] ?? ""}
              data={[{ value: "", label: "Everybody who may run it" }, ...options]}
              onChange={(event) => onPeople({ ...people, [role]: event.currentTarget.value })}
            />
          </CastRow>
        ))}
      </div>
    </fieldset>
  );
}

interface CastRowProps {
  actor: string;
  only: boolean;
  children: ReactNode;
}

function CastRow({ actor, only, children }: CastRowProps) {
  return (
    <>
      <span className={style.actor}>
        {actor !== "" && <i style={{ background: colorOfName(actor) }} aria-hidden />}
        {actorWords(actor, only)}
      </span>
      {children}
    </>
  );
}
