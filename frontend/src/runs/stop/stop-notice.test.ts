import { expect, test } from "vitest";
import type { LiveState, StopRequest } from "../../api/live-socket";
import { needsRestConfirmation } from "../../api/run-stop";
import type { Run } from "../../api/runs";
import { runToStop, stopButtonText } from "./stop-button";
import {
  headOf,
  movingAgain,
  noticeKey,
  noticeOf,
  othersNotice,
  unreachableNotice,
  wholeNotice,
} from "./stop-notice";

const stop: StopRequest = { id: "s", run: "r", at: 1000, runs: [], state: "heard", detail: "" };

function now(part: Partial<Run> | null, link: LiveState["link"] = "live"): LiveState {
  const run = {
    id: "r",
    number: 7,
    state: "running",
    ended_at: null,
    alarms: [],
    engine: "David",
    ...part,
  } as Run;
  const runs = new Map(part ? [["r", run]] : []);
  return { link, since: 0, engines: [], stops: [stop], asked: [], runs };
}

test("a Stop that nothing proves becomes loud", () => {
  expect(noticeOf(stop, now({ state: "stopping" }), 1500)?.tone).toBe("quiet");
  const later = noticeOf(stop, now({ state: "stopping" }), 9000);
  expect(later?.tone).toBe("loud");
  expect(later?.text).toContain("STOP UNCONFIRMED");
});

test("what is announced stays the same while only time goes by", () => {
  const early = noticeOf(stop, now({ state: "stopping" }), 9000);
  const late = noticeOf(stop, now({ state: "stopping" }), 9200);
  expect(early?.text).toBe(late?.text);
  expect([early?.since, late?.since]).toEqual(["asked 8.0 s ago", "asked 8.2 s ago"]);
});

test("stopped is said when the run's state says so", () => {
  const ended = now({ state: "stopped", ended_at: "1970-01-01T00:00:02Z" });
  expect(noticeOf(stop, ended, 2500)).toEqual({ tone: "done", text: "Run 7: stopped." });
  expect(noticeOf(stop, ended, 60_000)).toBeNull();
});

test("a Stop of everything says of its own runs what became of them, whatever the clocks say", () => {
  const all = { ...stop, run: "all", runs: ["r"] } as const;
  const ended = now({ state: "stopped", ended_at: "1969-01-01T00:00:02Z" }); // the runner's clock is behind
  expect(noticeOf(all, ended, 2500)).toEqual({ tone: "done", text: "Run 7: stopped." });
  const before = { ...all, runs: [] };
  const lost = now({ state: "lost", ended_at: "2100-01-01T00:00:00Z" }); // ended before it was asked
  expect(noticeOf(before, lost, 2500)?.text).toBe("The runner says that nothing runs.");
});

test("a run that the runner does not know any more is not said to be stopped", () => {
  const all = { ...stop, run: "all", runs: ["r", "gone"] } as const;
  const ended = now({ state: "stopped", ended_at: "1970-01-01T00:00:02Z" });
  expect(noticeOf(all, ended, 2500)).toMatchObject({ tone: "loud" });
  expect(noticeOf({ ...all, provenAt: 2000 }, ended, 2500)).toMatchObject({ tone: "done" });
});

test("a run that is started after a Stop of everything is not said to be stopping", () => {
  const all = { ...stop, run: "all", runs: [] } as const;
  expect(noticeOf(all, now({ state: "running" }), 2_500)).toBeNull();
  expect(noticeOf(all, now({ state: "running" }), 60_000)).toBeNull();
});

test("that nothing runs is said only where nothing can", () => {
  const all = { ...stop, run: "all", runs: [] } as const;
  const robot = { name: "David", state: "answering", simulated: false, holds: [] };
  const beside = (part: object) =>
    ({ ...now(null), engines: [{ ...robot, ...part }] }) as unknown as LiveState;
  expect(noticeOf(all, beside({}), 1500)?.tone).toBe("done");
  const held = { graph: "theirs", state: "RUNNING", active: true, run: null, stopping: "" };
  expect(noticeOf(all, beside({ holds: [held] }), 1500)?.text).toBe("Stopping theirs on David …");
  const silent = noticeOf(all, beside({ state: "busy", why: "It does not answer." }), 1500);
  expect(silent?.tone).toBe("loud");
  expect(silent?.text).toContain("NOT KNOWN what David runs");
  const loud = { ...held, stopping: "theirs has not stopped yet" };
  expect(noticeOf(all, beside({ holds: [loud] }), 9000)?.text).toContain(
    "STOP UNCONFIRMED: theirs on David: theirs has not stopped yet",
  );
});

test("without the runner nothing is claimed", () => {
  expect(noticeOf(stop, now({}, "down"), 1200)?.text).toContain("UNCONFIRMED");
  const unheard = { ...stop, state: "unheard", detail: "The runner does not answer." } as const;
  expect(noticeOf(unheard, now({}, "down"), 1200)?.text).toContain(
    "NOT SENT: use the hardware stop",
  );
  const unanswered = { ...stop, state: "asked" } as const;
  expect(noticeOf(unanswered, now({}), 1500)?.tone).toBe("quiet");
  expect(noticeOf(unanswered, now({}), 9000)?.text).toContain("NOT SENT");
});

test("a Stop that was heard says nothing of rest before the runner says something after it", () => {
  const awaiting = { ...stop, run: "all", runs: ["q"], awaits: "message" } as const;
  expect(noticeOf(awaiting, now(null), 1_500)).toMatchObject({ tone: "quiet", text: "Stop sent" });
  expect(noticeOf(awaiting, now(null), 9_000)?.text).toMatch(/^STOP UNCONFIRMED: sent, but no/);
  const ended = now({ state: "stopped", ended_at: "1970-01-01T00:00:00Z" });
  const one = { ...stop, awaits: "message" } as const;
  expect(noticeOf(one, ended, 1_500)?.text).toBe("Stop sent"); // it may move again
  const both = wholeNotice(
    {
      ...ended,
      stops: [
        { ...awaiting, runs: [] },
        { ...stop, provenAt: 2_000 },
      ],
    },
    NONE,
    9_000,
  );
  expect(both?.text).toMatch(/^STOP UNCONFIRMED: sent, but no word/);
});

test("no proof is promised to a page whose session has ended", () => {
  const unreached = { kind: "ended", why: "Your session has ended." } as const;
  const ended = { ...now(null, "down"), unreached };
  expect(noticeOf({ ...stop, run: "all" }, ended, 9_000)?.text).toMatch(
    /only once somebody signs in/,
  );
  expect(noticeOf({ ...stop, run: "all" }, now(null, "down"), 9_000)?.text).not.toMatch(/session/);
});

test("what was proven stays proven when the runner is silent later, and the rest is said apart", () => {
  const proof = { proof_at: "1970-01-01T00:00:02Z", ended_at: "1970-01-01T00:00:02Z" };
  const ended = now({ state: "stopped", ...proof }, "down");
  for (const at of [2_500, 60_000]) {
    for (const asked of [stop, { ...stop, run: "all", runs: ["r"], provenAt: 2_000 } as const]) {
      expect(noticeOf(asked, ended, at)?.text ?? "").not.toContain("UNCONFIRMED");
    }
  }
  const soon = noticeOf(stop, ended, 2_500);
  expect(soon?.tone).toBe("done");
  expect(soon?.text).toMatch(
    /^Proven: run 7: stopped at \d\d:\d\d:\d\d\. The runner is silent since/,
  );
  const other = { ...ended.runs.get("r"), id: "q", number: 8, ended_at: null } as Run;
  const both = { ...ended, runs: new Map([...ended.runs, ["q", other]]) };
  const all = { ...stop, run: "all", runs: ["r", "q"] } as const;
  const text = noticeOf(all, both, 9_000)?.text;
  expect(text).toMatch(/^STOP UNCONFIRMED: run 8 on David: sent, but no word/);
  expect(text).toMatch(/Proven before that: run 7: stopped at/);
  // That nothing was known to run proves nothing when nobody said so.
  expect(noticeOf({ ...stop, run: "all" }, now(null, "down"), 2_500)?.tone).toBe("loud");
  // What moves again is not proven any more.
  expect(noticeOf({ ...all, provenAt: 2_000 }, both, 9_000)?.tone).toBe("loud");
});

test("a name that turns words around keeps the words of a notice where they are", () => {
  const loud = noticeOf(stop, now({ engine: "Da\u202evid" }), 9_000)?.text;
  expect(loud).toMatch(/^STOP UNCONFIRMED: run 7 on \u2068Da\u202evid\u2069: /);
  const named = { id: "a", number: 1, graph_name: "\u202egrab", group: null } as Run;
  expect(runToStop([named])?.words).toBe("run 1 of \u2068\u202egrab\u2069");
});

test("a reason that turns words around keeps the words after it where they are", () => {
  const detail = "no \u202e such";
  const kept = `\u2068${detail}\u2069`;
  const refused: StopRequest = { ...stop, state: "refused", detail };
  expect(noticeOf(refused, now(null), 2_000)?.text).toContain(`: ${kept} Use the`);
  const unheard: StopRequest = { ...stop, state: "unheard", detail };
  expect(noticeOf(unheard, now(null), 2_000)?.text).toContain(`. ${kept} Trying`);
  const lost = now({ state: "lost", ended_at: "1970-01-01T00:00:02Z", detail });
  expect(noticeOf(stop, lost, 2_500)?.text).toContain(`: ${kept} Look`);
  const gone = { ...now(null, "down"), unreached: { kind: "silent", why: detail } } as const;
  expect(unreachableNotice(gone, 60_000)?.text).toContain(`: ${kept} Use the`);
});

test("a refused Stop says why", () => {
  expect(noticeOf({ ...stop, state: "refused", detail: "no such run" }, now(null), 1200)).toEqual({
    tone: "loud",
    text: "Stop refused: no such run Use the hardware stop.",
  });
});

test("an engine that was restarted has not stopped", () => {
  const detail = "The engine was restarted while the run went on.";
  const lost = now({ state: "lost", ended_at: "1970-01-01T00:00:02Z", detail });
  const notice = noticeOf(stop, lost, 2500);
  expect(notice?.tone).toBe("loud");
  expect(notice?.text).toContain("restarted");
});

test("a Stop of somebody else that nothing proves is shouted here, too, with the reason", () => {
  const alarm = { code: "stop_unconfirmed", at: "", text: "STOP UNCONFIRMED: it is deaf." };
  const stopping = now({ state: "stopping", desired: "stopped", alarms: [alarm] });
  expect(othersNotice(stopping)?.text).toBe("STOP UNCONFIRMED: run 7 on David: it is deaf.");
  expect(othersNotice(now({ desired: "running", alarms: [alarm] }))).toBeNull();
});

test("what an engine gave up is shouted whoever asked for it, until somebody has looked", () => {
  const unconfirmed = "Grip_0 did not obey within 5 s";
  const left = now({ state: "unknown", desired: "running", unconfirmed });
  expect(othersNotice(left)?.text).toContain(
    "run 7 on David: Grip_0 did not obey within 5 s. Look",
  );
  const over = { state: "error", unconfirmed: null, ended_at: "1970-01-01T00:00:02Z" } as const;
  expect(othersNotice(now({ ...over, desired: "running" }))).toBeNull();
});

test("a person's word is asked for only where no answer can prove rest", () => {
  const run = { ended_at: null, simulated: false, started_at: "", unknown_since: null } as Run;
  const moving = { a: { state: "RUNNING" } } as unknown as NonNullable<Run["actions"]>;
  expect(needsRestConfirmation({ ...run, state: "running" })).toBe(false);
  expect(needsRestConfirmation({ ...run, state: "lost" })).toBe(true);
  expect(needsRestConfirmation({ ...run, state: "unknown", unknown_since: "1970" })).toBe(true);
  expect(needsRestConfirmation({ ...run, state: "stopping", unconfirmed: "why" })).toBe(true);
  expect(
    needsRestConfirmation({ ...run, state: "running", unconfirmed: "why", actions: moving }),
  ).toBe(false);
  expect(needsRestConfirmation({ ...run, state: "lost", simulated: true })).toBe(false);
});

test("beside a graph, Stop means its run or the group it is in, and else everything", () => {
  const one = { id: "a", number: 1, graph_name: "patrol", group: "g" } as Run;
  const two = { ...one, id: "b", number: 2 };
  expect(runToStop([])).toBeNull();
  expect(runToStop([one])?.id).toBe("a");
  expect(runToStop([one, two])).toEqual({ id: "g", words: "the 2 runs of patrol" });
  expect(runToStop([one, { ...two, group: null }])).toBeNull();
});

test("a run that was called stopped and moves again is shouted before anything else", () => {
  const text = "MOVES AGAIN: David shows Work_0 moving in patrol, after it was called stopped.";
  const alarms = [{ code: "moves_again", at: "", text }];
  const moves = { state: "stopping", desired: "stopped", moves_again_at: "t", alarms } as const;
  expect(movingAgain(now(null))).toBeNull();
  expect(movingAgain(now({ state: "stopped", ended_at: "t" }))).toBeNull();
  const notice = movingAgain(now(moves as unknown as Partial<Run>));
  expect(notice).toMatchObject({ tone: "loud", stays: true });
  expect(notice?.text).toContain("MOVES AGAIN: run 7: David shows Work_0 moving");
  expect(notice?.text).toContain("It is being stopped again.");
  expect(notice?.text).toContain("hardware stop");
});

test("what moves again hides no Stop that is not sent, refused or unconfirmed", () => {
  const text = "MOVES AGAIN: David shows Work_0 moving.";
  const alarms = [{ code: "moves_again", at: "", text }];
  const moves = { desired: "running", moves_again_at: "t", alarms } as unknown as Partial<Run>;
  const whole = (stops: readonly StopRequest[], link: LiveState["link"] = "live") =>
    wholeNotice({ ...now(moves, link), stops }, NONE, 60_000);
  expect(whole([])?.text).toMatch(/^MOVES AGAIN: .* Nobody has asked to stop it\./);
  const sent: StopRequest = { ...stop, run: "all", detail: "A fault." };
  const unsent = whole([{ ...sent, state: "unheard" }], "down");
  expect(unsent && headOf(unsent)).toBe("MOVES AGAIN · NOT SENT");
  expect(unsent?.text).not.toContain("Nobody");
  const refused = whole([{ ...stop, state: "refused", detail: "Withdrawn." }]);
  expect(refused?.text).toMatch(/^MOVES AGAIN: .* Stop refused: Withdrawn\./);
  expect(refused?.text).not.toContain("Nobody");
  expect(whole([{ ...stop, run: "q", state: "refused" }])?.text).toContain("Nobody");
  const { runs, ...state } = now(moves);
  const deaf = { ...runs.get("r"), id: "q", number: 8, moves_again_at: null, alarms: [] };
  const theirs = { ...deaf, desired: "stopped", unconfirmed: "no answer" } as unknown as Run;
  const both = { ...state, stops: [], runs: new Map(runs).set("q", theirs) };
  expect(wholeNotice(both, NONE, 60_000)?.text).toMatch(
    /^MOVES AGAIN: run 7.*STOP UNCONFIRMED: run 8/,
  );
});

test("what is put aside keeps its head, and comes back when it is about something else", () => {
  const loud = (text: string) => ({ tone: "loud", text, stays: true }) as const;
  const one = loud("STOP UNCONFIRMED: run 7 on David: no proof has come.");
  expect(headOf(one)).toBe("STOP UNCONFIRMED");
  expect(noticeKey(loud("STOP UNCONFIRMED: run 7 on David: it is deaf."))).toBe(noticeKey(one));
  expect(noticeKey(loud("STOP UNCONFIRMED: run 8 on Eve: it is deaf."))).not.toBe(noticeKey(one));
  expect(noticeKey(loud("MOVES AGAIN: run 7: David moves."))).not.toBe(noticeKey(one));
});

test("a runner that is not reached is never silence", () => {
  for (const link of ["connecting", "down"] as const) {
    const why = "The runner does not answer.";
    const lost: LiveState = { ...now(null, link), unreached: { kind: "silent", why } };
    expect(unreachableNotice(lost, 1_000)).toBeNull(); // a moment is nothing to shout about
    const notice = unreachableNotice(lost, 60_000);
    expect(notice?.tone).toBe("loud");
    expect(notice?.text).toContain("The runner does not answer.");
    expect(notice?.text).toContain("hardware stop");
    expect(stopButtonText(link, 0)).not.toBe("nothing runs");
    expect(stopButtonText("live", 0, 1)).toBe("1 unknown");
    expect(stopButtonText("live", 2, 1)).toBe("2 runs");
  }
  expect(unreachableNotice(now(null), 60_000)).toBeNull();
  const mute = {
    ...now(null, "down"),
    unreached: { kind: "mute", why: "No socket opens." },
  } as const;
  expect(unreachableNotice(mute, 60_000)?.text).toContain("CANNOT BE PROVEN");
});

const NONE: ReadonlySet<string> = new Set();

/** Two runs, of which the second one was stopped, and these Stops. */
function withStops(...stops: StopRequest[]): LiveState {
  const { runs, ...state } = now({ state: "running", group: "both" });
  const ended = { state: "stopped", ended_at: "1970-01-01T00:00:02Z" };
  const second = { ...runs.get("r"), id: "q", number: 8, engine: "Carol", ...ended } as Run;
  return { ...state, stops, runs: new Map(runs).set("q", second) };
}

const unsent: StopRequest = { ...stop, id: "u", state: "unheard", detail: "A fault." };
const proven: StopRequest = { ...stop, id: "p", run: "q", at: 1500, provenAt: 2000 };

test("a Stop that was not sent stays in sight beside a later one that is proven, and says its run", () => {
  for (const dismissed of [NONE, new Set(["u"])]) {
    const notice = wholeNotice(withStops(unsent, proven), dismissed, 2500);
    expect(notice).toMatchObject({ tone: "loud", stays: true });
    expect(notice?.text).toMatch(/^NOT SENT: .*run 7 on David\. Run 8: stopped\.$/);
    expect(wholeNotice(withStops(unsent, proven), dismissed, 60_000)?.text).toMatch(/^NOT SENT/);
  }
  const refused: StopRequest = { ...unsent, state: "refused" };
  expect(wholeNotice(withStops(refused, proven), NONE, 60_000)?.text).toMatch(/^Stop refused/);
  expect(wholeNotice(withStops(refused, proven), new Set(["u"]), 60_000)).toBeNull();
});

test("a Stop that is unconfirmed stays in sight beside a later one that is proven", () => {
  const notice = wholeNotice(withStops(stop, proven), NONE, 5000);
  expect(notice?.text).toMatch(/^STOP UNCONFIRMED: run 7 .* Run 8: stopped\.$/);
  const two = wholeNotice(withStops(stop, { ...unsent, run: "q", at: 1500 }), NONE, 5000);
  expect(two && headOf(two)).toBe("NOT SENT · STOP UNCONFIRMED");
});

test("a later STOP ALL covers no run whose loss left its Stop unconfirmed", () => {
  const detail = "The engine was restarted while the run went on.";
  const lost = now({ state: "lost", ended_at: "1970-01-01T00:00:02Z", detail });
  const all: StopRequest = { ...stop, id: "a", run: "all", at: 50_000, provenAt: 51_000 };
  const notice = wholeNotice({ ...lost, stops: [stop, all] }, NONE, 60_000);
  expect(notice).toMatchObject({ tone: "loud" });
  expect(notice?.text).toMatch(/^STOP UNCONFIRMED: run 7 on David: The engine was restarted/);
});

test("a later STOP ALL covers no earlier one whose runs are lost, or not known to rest", () => {
  const first: StopRequest = { ...stop, run: "all", runs: ["r"] };
  const later: StopRequest = { ...stop, id: "l", run: "all", at: 50_000, provenAt: 51_000 };
  const detail = "The engine was restarted while the run went on.";
  const lost = now({ state: "lost", ended_at: "1970-01-01T00:00:02Z", detail });
  for (const state of [lost, now(null)]) {
    const notice = wholeNotice({ ...state, stops: [first, later] }, NONE, 52_000);
    expect(notice?.text).toMatch(/^STOP UNCONFIRMED: .* The runner says that nothing runs\.$/);
  }
});

test("a later Stop of the same run, of its group or of everything takes the place of an earlier one", () => {
  for (const run of ["r", "both", "all"]) {
    const later: StopRequest = { ...stop, id: "l", run, at: 1500, runs: ["r"] };
    const said = wholeNotice(withStops(unsent, later), NONE, 2500);
    expect(said).toMatchObject({ tone: "quiet", text: "Stopping run 7 …" });
  }
  const all: StopRequest = { ...unsent, run: "all", runs: ["r"] };
  const said = wholeNotice(withStops(all, { ...stop, at: 1500 }), NONE, 2500);
  expect(said?.text).toMatch(/^NOT SENT: .* Stopping run 7 …$/);
});

test("a Stop of somebody else that is unconfirmed stays in sight beside one's own that is proven", () => {
  const { runs, ...state } = withStops(proven);
  const theirs = { ...runs.get("r"), desired: "stopped", unconfirmed: "no answer" } as Run;
  const both = { ...state, runs: new Map(runs).set("r", theirs) };
  const notice = wholeNotice(both, NONE, 2500);
  expect(notice).toMatchObject({ tone: "loud", stays: true });
  expect(notice?.text).toMatch(/^STOP UNCONFIRMED: run 7 .* Run 8: stopped\.$/);
  const mine = wholeNotice({ ...both, stops: [stop] }, NONE, 2500);
  expect(mine?.text).toBe("Stopping run 7 …"); // its own notice tells of it, in time
});
