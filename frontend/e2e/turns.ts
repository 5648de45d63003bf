/** What tries in other ways what others try has its turn every third day, by UTC; `make soak` tries all. */

const DAY = Number(process.env.TEST_DAY ?? Math.floor(Date.now() / 86_400_000));

const TURNS = 3;

/** Why a test of a turn (0, 1 or 2) is skipped today; empty on its day, in `make soak`, and where files are named. */
export function anotherDay(turn: number): string {
  if (process.env.TEST_ALL_TURNS || turn === DAY % TURNS) return "";
  return "has its turn on another day: TEST_DAY names one";
}
