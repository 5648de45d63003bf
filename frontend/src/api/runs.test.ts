import { expect, test, vi } from "vitest";
import { giveOutcome, letGoOn, letWait } from "./presses";
import { addRunNote } from "./run-notes";
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

/** Sends requests to nobody; `answers` gives the answer to each, null for one that gets lost. */
function sentTo(answers: (Response | null)[]): Record<string, unknown>[] {
  const sent: Record<string, unknown>[] = [];
  vi.stubGlobal("fetch", (_: unknown, init: RequestInit) => {
    sent.push(JSON.parse(String(init.body)));
    const answer = answers.shift() ?? null;
    return answer === null ? Promise.reject(new TypeError("no answer")) : Promise.resolve(answer);
  });
  return sent;
}

const json = (status: number, body: unknown) =>
  new Response(JSON.stringify(body), { status, headers: { "content-type": "application/json" } });
const taken = () => json(202, {});
const refusal = () => json(409, { type: "conflict", title: "No", status: 409, detail: "No." });
const lost = null;
const since = "2026-01-01T00:00:00Z";

test("a press whose answer got lost is sent again with the same request id", async () => {
  const sent = sentTo([lost, taken(), taken()]);
  await expect(letGoOn("http://runner", "12", since)).rejects.toThrow();
  await letGoOn("http://runner", "12", since);
  await letGoOn("http://runner", "12", since);
  const ids = sent.map(({ request_id }) => request_id);
  expect(ids[0]).toBe(ids[1]);
  expect(ids[0]).toBeTruthy();
  expect(ids[2]).not.toBe(ids[0]);
});

test("each Wait has a request id of its own, since one that counted before would hold nothing", async () => {
  const sent = sentTo([lost, taken()]);
  await expect(letWait("http://runner", "12")).rejects.toThrow();
  await letWait("http://runner", "12");
  expect(new Set(sent.map(({ request_id }) => request_id)).size).toBe(2);
});

test("a lost press counts with no press of another person, and with none long after it", async () => {
  vi.useFakeTimers();
  const person = (id: string) => JSON.stringify({ id, name: id, role: "operator" });
  let now = person("ann");
  vi.stubGlobal("localStorage", { getItem: () => now });
  const sent = sentTo([lost, taken(), taken(), lost, taken()]);
  const press = () => letGoOn("http://runner", "13", since);
  await expect(press()).rejects.toThrow();
  now = person("ben");
  await press();
  now = person("ann");
  await press();
  await expect(press()).rejects.toThrow();
  vi.setSystemTime(Date.now() + 31 * 60_000);
  await press();
  const ids = sent.map(({ request_id }) => request_id);
  expect(ids[2]).toBe(ids[0]);
  expect(new Set(ids).size).toBe(4);
  vi.useRealTimers();
});

test("a press that was refused, and one of another thing, has a request id of its own", async () => {
  const sent = sentTo([refusal(), lost, taken(), lost, lost]);
  await expect(letGoOn("http://runner", "12", since)).rejects.toThrow("No.");
  await expect(letGoOn("http://runner", "12", since)).rejects.toThrow();
  await letGoOn("http://runner", "12", "2026-01-01T00:00:09Z");
  const word = { action: "Scan_0", outcome: "true", reason: " I saw it. ", piece: "12.3" } as const;
  await expect(giveOutcome("http://runner", "12", word)).rejects.toThrow();
  await expect(giveOutcome("http://runner", "12", { ...word, outcome: "false" })).rejects.toThrow();
  expect(new Set(sent.map(({ request_id }) => request_id)).size).toBe(5);
});

test("a note whose answer got lost is the same note when it is sent again, at a later moment too", async () => {
  const sent = sentTo([lost, taken(), taken()]);
  const note = (moment: string | null) =>
    addRunNote("http://runner", "12", { text: "odd", moment });
  await expect(note(since)).rejects.toThrow();
  await note("2026-01-01T00:00:09Z");
  await note(null);
  const ids = sent.map(({ request_id }) => request_id);
  expect(ids[0]).toBeTruthy();
  expect(ids[1]).toBe(ids[0]);
  expect(ids[2]).not.toBe(ids[0]);
});
