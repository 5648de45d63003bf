/** Rights of robots: who may start there, who holds the baton, and who has put one out of service. */
import { useQuery } from "@tanstack/react-query";
import { isolated } from "../words/isolated";
import { editor, runnerAt } from "./client";
import { useLive } from "./page-link";
import { useKnownPeople, usePerson } from "./people";
import type { Robot } from "./robots";
import type { Run } from "./runs";
import type { RunnerApi } from "./schema/runner";

/** Rights of the signed-in person on a robot. `why`: why they may not start there, "" if they may. */
export type RobotRight = RunnerApi["RightShown"];
export type RightsWanted = Required<RunnerApi["RightsWanted"]>;
export type ReportedStop = RunnerApi["HardwareStopShown"];
export type PagePresence = RunnerApi["PagePresence"];
export type HealthCheck = RunnerApi["HealthCheckShown"];
export type LimitedTo = RunnerApi["Limit"];
export type AllowedOperator = RunnerApi["OperatorShown"];

/** Return a limit in words, as "torque of Grip at most 60". */
export function limitWords({ parameter, action, least, most }: LimitedTo): string {
  const of = action === "" ? "" : ` of ${isolated(action)}`;
  const place = isolated(parameter) + of;
  if (least === null) return `${place} at most ${most}`;
  return most === null ? `${place} at least ${least}` : `${place} from ${least} to ${most}`;
}

/** Return the rule about visible pages on a robot in words. */
export function pageWords({ wait_s, stop_s }: PagePresence): string {
  return `without a visible page a led run waits after ${wait_s} s, and each run is stopped after ${stop_s} s`;
}

/** Asks what the signed-in person may do on all robots; asked again when the rights of one change. */
export function useRights() {
  const { runner, now } = useLive();
  const { person, visit } = usePerson();
  const known = now.engines.map(({ name, operators, baton, holder, locks, drill_due, pressed }) => [
    name,
    operators,
    baton,
    holder,
    locks,
    drill_due,
    pressed,
  ]);
  return useQuery({
    queryKey: ["robots", "rights", person.id, person.role, visit, JSON.stringify(known)],
    queryFn: ({ signal }) => runnerAt(runner).get("/api/rights", { signal }),
    enabled: runner !== undefined && now.engines.some((robot) => !robot.simulated),
    refetchInterval: 10_000,
    placeholderData: (before) => before,
  });
}

/** The person's rights on one robot; undefined while they are not known. */
export function useRight(robot: string): RobotRight | undefined {
  return useRights().data?.robots.find((each) => each.robot === robot);
}

interface Named {
  readonly id: string;
  readonly name: string;
}

const NO_IDS: readonly string[] = [];

/** Queries the groups and people to whom a right can be given: persons of links, and all who acted here. */
export function useEntitled(): { groups: readonly Named[]; people: readonly Named[] } {
  const known = useKnownPeople(NO_IDS);
  const { data } = useQuery({
    queryKey: ["members", "entitled"],
    queryFn: ({ signal }) => editor.get("/api/members", { signal }),
    staleTime: 10_000,
  });
  const members = data?.people ?? [];
  const others = known.filter(({ id }) => !members.some((member) => member.id === id));
  return { groups: data?.groups ?? [], people: [...members, ...others] };
}

export function takeBaton(runner: string, name: string, reason = ""): Promise<Robot> {
  return runnerAt(runner).post("/api/robots/{name}/baton/take", {
    path: { name },
    body: { reason },
  });
}

export function handBaton(runner: string, name: string, to: string): Promise<Robot> {
  return runnerAt(runner).post("/api/robots/{name}/baton/hand", { path: { name }, body: { to } });
}

export function dropBaton(runner: string, name: string): Promise<Robot> {
  return runnerAt(runner).post("/api/robots/{name}/baton/drop", { path: { name } });
}

/** Hands a led run over with all batons of its robots, so that it goes on. */
export function handOverRun(runner: string, run: string, to: string): Promise<Run> {
  return runnerAt(runner).post("/api/runs/{run}/hand_over", { path: { run }, body: { to } });
}

export function lockRobot(runner: string, name: string, reason: string): Promise<Robot> {
  return runnerAt(runner).post("/api/robots/{name}/lock", { path: { name }, body: { reason } });
}

/** Takes off one's own lock, or as an owner that of the person `of`. */
export function unlockRobot(runner: string, name: string, of: string): Promise<Robot> {
  return runnerAt(runner).post("/api/robots/{name}/unlock", { path: { name }, body: { of } });
}

/** Records a Stop drill: a run on the robot that was stopped, and what the person saw. */
export function recordDrill(
  runner: string,
  name: string,
  body: RunnerApi["DrillRequest"],
): Promise<Robot> {
  return runnerAt(runner).post("/api/robots/{name}/drills", { path: { name }, body });
}

export function setRights(runner: string, name: string, rights: RightsWanted): Promise<Robot> {
  return runnerAt(runner).put("/api/robots/{name}/rights", { path: { name }, body: rights });
}
