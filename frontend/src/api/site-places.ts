/** Where a run or a robot is, for an address that stands for all runners, and by which clock its times are. */
import { serverTimeOf } from "../clock/server-clock";
import { routerOf, routing, siteOfId } from "./sites";

/** Return the runner that has a run or a repeat. */
export function runnerOfRun(address: string, run: string): string {
  return routerOf(address)?.siteOfId(run)?.url ?? address;
}

/** Return the runner that has a robot. */
export function runnerOfRobot(address: string, robot: string): string {
  return routerOf(address)?.sitesOfRobot(robot)[0]?.url ?? address;
}

/** Return why a robot cannot get this name at a site; "" if it can, and with one runner. */
export function takenElsewhere(robot: string, url: string): string {
  return routing()?.takenElsewhere(robot, url) ?? "";
}

/** Return the milliseconds from a time that the runner of a run says to the same moment by the page's clock. */
export function shiftOfRun(run: string): number {
  return routing()?.shiftOf(siteOfId(run)) ?? 0;
}

/** Return the time of a tick by the clock of the runner of a run, ms since 1970. */
export function runTimeOf(run: string, at: number): number {
  return serverTimeOf(at) - shiftOfRun(run);
}

/** Return the milliseconds from a time that the runner of a robot says to the same moment by the page's clock. */
export function shiftOfRobot(robot: string): number {
  const known = routing();
  return known?.shiftOf(known.sitesOfRobot(robot)[0]) ?? 0;
}
