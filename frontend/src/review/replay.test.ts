import fc from "fast-check";
import { expect, test } from "vitest";
import type { Frame, Replay } from "../api/review";
import type { Run, Visit } from "../api/runs";
import { chapterAt, framesBy, ReplayPlayer, runAfter, runBefore, shows } from "./replay";

const at = (ms: number) => new Date(1_000_000 + ms).toISOString();

const visit = (from: number, until: number | null, result: Visit["result"] = null): Visit => ({
  from: at(from),
  not_before: at(from),
  not_after: until === null ? null : at(until),
  until: until === null ? null : at(until),
  result,
  how: "observed",
  inputs: null,
});

const RUN: Run = {
  id: "r",
  number: 1,
  group: null,
  graph: "g",
  graph_name: "patrol",
  version: "v",
  digest: "d",
  engine: "simulator",
  simulated: true,
  state: "finished",
  desired: "running",
  proof_at: null,
  unknown_since: null,
  unconfirmed: null,
  at_rest: null,
  took: null,
  moves_again_at: null,
  result: "on_true",
  requested_at: at(0),
  started_at: at(1),
  ended_at: at(99),
  author: { id: "p", name: "Ada" },
  stopped_by: null,
  detail: "",
  alarms: [],
  recorded: true,
  robots: null,
  held: null,
  actions: {
    Go_0: { aid: "a", state: "FINISHED", visits: [visit(2, 9, "true")], older: 0, messages: [] },
    "Sub/Go_0": { aid: null, state: "FINISHED", visits: [], older: 0, messages: [] },
  },
};

const FRAMES: Frame[] = [
  { seq: 1, at: at(0), kind: "run.requested.v1", head: { state: "requested" } },
  { seq: 2, at: at(1), kind: "run.published.v1", head: { state: "running", started_at: at(1) } },
  {
    seq: 3,
    at: at(2),
    kind: "run.observed.v1",
    actions: { Go_0: { state: "RUNNING", first: 0, visits: [visit(2, null)] } },
  },
  { seq: 4, at: at(5), kind: "run.stop_sent.v1" },
  {
    seq: 5,
    at: at(9),
    kind: "run.observed.v1",
    actions: { Go_0: { state: "FINISHED", first: 0, visits: [visit(2, 9, "true")] } },
  },
  {
    seq: 6,
    at: at(99),
    kind: "run.ended.v1",
    head: { state: "finished", ended_at: at(99), result: "on_true" },
  },
];

const replay = (frames: Frame[]): Replay => ({
  run: "r",
  after: 0,
  newest: frames.length,
  base: null,
  frames,
  chapters: [{ after: 0, at: at(0) }],
  marks: [],
});

const ms = (text: string) => Date.parse(text);

test("what was learned later does not show earlier", () => {
  const player = new ReplayPlayer(replay(FRAMES), RUN);
  const early = player.at(ms(at(3)));
  expect(early.state).toBe("running");
  expect(early.ended_at).toBeNull();
  expect(early.result).toBeNull();
  expect(early.actions?.Go_0?.visits).toEqual([visit(2, null)]);
  expect(early.actions?.["Sub/Go_0"]).toBeUndefined(); // it had not been heard of
});

test("at its end the replay shows what is known now", () => {
  const player = new ReplayPlayer(replay(FRAMES), RUN);
  const end = player.at(ms(at(99)));
  expect(end.state).toBe("finished");
  expect(end.actions?.Go_0).toEqual({ ...RUN.actions?.Go_0 });
});

test("a step goes from one visible change to the next and back", () => {
  const player = new ReplayPlayer(replay(FRAMES), RUN);
  expect(player.next(ms(at(2)))).toBe(ms(at(9))); // not the stop message, which changes nothing
  expect(player.previous(ms(at(9)))).toBe(ms(at(2)));
  expect(player.next(ms(at(99)))).toBeNull();
  expect(shows(FRAMES[3] as Frame)).toBe(false);
});

test("asking for moments in any order tells the same as playing through", () => {
  const frame = fc.record({
    state: fc.constantFrom("RUNNING", "FINISHED"),
    first: fc.nat(3),
    visits: fc.array(
      fc.nat(50).map((n) => visit(n, n + 1)),
      { maxLength: 3 },
    ),
  });
  fc.assert(
    fc.property(fc.array(frame, { maxLength: 20 }), fc.array(fc.nat(25)), (changes, order) => {
      const frames = changes.map((action, i) => ({
        seq: i + 1,
        at: at(i),
        kind: "run.observed.v1",
        actions: { Go_0: action },
      }));
      const player = new ReplayPlayer(replay(frames), RUN);
      for (const count of order) {
        const wanted = frames.slice(0, count).reduce(runAfter, runBefore(RUN));
        expect(player.after(count)).toEqual(wanted);
      }
    }),
  );
});

test("visits that are not kept singly are counted", () => {
  const base = runBefore(RUN);
  const later = runAfter(base, {
    seq: 9,
    at: at(9),
    kind: "run.observed.v1",
    actions: { Go_0: { state: "RUNNING", first: 120, visits: [visit(9, null)] } },
  });
  expect(later.actions?.Go_0?.older).toBe(120);
  expect(later.actions?.Go_0?.visits).toHaveLength(1);
});

test("a moment belongs to the page that begins before it", () => {
  const chapters = [
    { after: 0, at: at(0) },
    { after: 2000, at: at(50) },
  ];
  expect(chapterAt(chapters, ms(at(49)))).toBe(0);
  expect(chapterAt(chapters, ms(at(50)))).toBe(2000);
  expect(framesBy(FRAMES, ms(at(2)))).toBe(3);
});
