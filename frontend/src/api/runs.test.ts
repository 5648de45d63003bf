import { expect, test } from "vitest";
import { abilitiesOf, currentAlarm, type Run } from "./runs";

const alarm = (code: string, second: number) => ({
  code,
  at: `2026-01-01T00:00:0${second}Z`,
  text: code,
});

function run(alarms: Run["alarms"], begun?: number): Run {
  const from = `2026-01-01T00:00:0${begun}Z`;
  const visits = begun === undefined ? [] : [{ from }];
  return { engine: "simulator", alarms, actions: { Wait_0: { visits } } } as unknown as Run;
}

test("that nothing moves is said for as long as nothing does", () => {
  const other = alarm("foreign_other", 2);
  expect(currentAlarm(run([]))).toBeUndefined();
  expect(currentAlarm(run([other, alarm("stalled", 5)], 3))?.code).toBe("stalled");
  expect(currentAlarm(run([other, alarm("stalled", 5)], 7))?.code).toBe("foreign_other");
  expect(currentAlarm(run([alarm("H4", 5)], 7))?.code).toBe("H4");
});

test("the simulator can what the robot can that it plays", () => {
  expect(abilitiesOf(run([]))).toBe("simulator");
  expect(abilitiesOf({ ...run([]), like: "David" })).toBe("David");
});
