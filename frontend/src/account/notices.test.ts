import { expect, test } from "vitest";
import type { LiveState } from "../api/live-socket";
import type { Inbox } from "../api/mentions";
import { NewNotices, noticesOf } from "./notices";

type Runs = LiveState["runs"];
type Run = Runs extends ReadonlyMap<string, infer R> ? R : never;

const at = "2026-11-28T12:00:00Z";
const run = (fields: Partial<Run>): Run =>
  ({
    id: "r1",
    number: 12,
    graph_name: "Fetch",
    engine: "David",
    simulated: false,
    state: "running",
    result: null,
    ended_at: null,
    detail: "",
    alarms: [],
    robots: null,
    held: null,
    ...fields,
  }) as Run;
const live = (one: Run, state = "busy") => ({
  runs: new Map([[one.id, one]]),
  engines: [{ name: "David", state }] as unknown as LiveState["engines"],
});
const textsOf = (one: Run, state?: string) =>
  noticesOf(live(one, state), undefined).map(({ text }) => text);

test("a run that goes well, or in the simulator, is no notice", () => {
  expect(textsOf(run({}))).toEqual([]);
  expect(textsOf(run({ state: "finished", ended_at: at }))).toEqual([]);
  expect(textsOf(run({ state: "stopped", ended_at: at }))).toEqual([]);
  expect(textsOf(run({ state: "error", ended_at: at, simulated: true }))).toEqual([]);
});

test("each fact is a sentence, the same as in a mail", () => {
  const failed = run({ state: "error", ended_at: at, detail: "a_0 fell." });
  expect(textsOf(failed)).toEqual(["Run 12 of Fetch on David has failed: an error. a_0 fell."]);
  const alarms = [{ code: "stop_unconfirmed", at, text: "STOP UNCONFIRMED: no proof." }];
  expect(textsOf(run({ alarms }))).toEqual([
    "The Stop of run 12 of Fetch on David is unconfirmed: David may still be moving. STOP UNCONFIRMED: no proof.",
  ]);
  const robots = { "": "David", arm: "Bob" };
  expect(textsOf(run({ robots, held: { by: null, why: "Bob is silent.", since: at } }))).toEqual([
    "Run 12 of Fetch on David, Bob waits for a person, who lets it go on or stops it. Bob is silent.",
  ]);
  expect(textsOf(run({}), "gone")).toEqual([
    "David does not answer any more, and run 12 of Fetch is not over.",
  ]);
});

test("a question is told once, also when it is asked again", () => {
  const asking = (id: string) => {
    const question = { id, action: "AaConfirm_1", visit: 1, text: "Is the door open?" };
    return noticesOf(
      live(run({ questions: [question] as NonNullable<Run["questions"]> })),
      undefined,
    );
  };
  const news = new NewNotices([]);
  expect(news.take(asking("q1")).map(({ text }) => text)).toEqual([
    "Run 12 of Fetch on David waits for the answer of a person. Is the door open?",
  ]);
  expect(news.take(asking("q2"))).toEqual([]);
});

test("whatever direction names and reasons of others have ends with them", () => {
  const failed = run({ state: "error", ended_at: at, graph_name: "\u202eA", detail: "\u202eB" });
  expect(textsOf(failed)).toEqual([
    "Run 12 of \u2068\u202eA\u2069 on David has failed: an error. \u2068\u202eB\u2069",
  ]);
});

test("an unread mention leads to its comment", () => {
  const mention = {
    key: "t/1",
    graph: "g1",
    graph_name: "Fetch",
    author: { id: "m", name: "Mari" },
    at,
    text: "@Ben",
    is_read: false,
  };
  const inbox: Inbox = {
    unread: 1,
    mentions: [mention, { ...mention, key: "t/2", is_read: true }],
  };
  const none = { runs: new Map(), engines: [] };
  expect(noticesOf(none, inbox)).toEqual([
    {
      key: "mention:t/1",
      text: "Mari has mentioned you in a comment on Fetch.",
      path: "/graphs/g1?comment=t%2F1",
      mention: "t/1",
    },
  ]);
});

test("only what is new is told, and once", () => {
  const [a, b] = ["a", "b"].map((key) => ({ key, text: key, path: "/" })) as [never, never];
  const news = new NewNotices([a]);
  expect(news.take([a])).toEqual([]);
  expect(news.take([a, b])).toEqual([b]);
  expect(news.take([])).toEqual([]);
  expect(news.take([a, b])).toEqual([]);
});
