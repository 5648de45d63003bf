import { expect, test } from "vitest";
import { Refusal } from "../api/http";
import type { StartFound } from "../api/runs";
import {
  missing,
  type SentStart,
  sendNoted,
  Unanswered,
  UnansweredStarts,
  unansweredStarts,
  unknownWords,
} from "./unanswered-starts";

const sent: SentStart = {
  request: "q",
  graph: "g",
  what: "v3 of patrol",
  engines: ["David", "Eve"],
  at: 1,
};

class Tab {
  readonly kept = new Map<string, string>();
  getItem = (key: string) => this.kept.get(key) ?? null;
  setItem = (key: string, text: string) => void this.kept.set(key, text);
}

test("a start that waits for its answer is not unsure, and one that was answered is forgotten", () => {
  const tab = new Tab();
  const starts = new UnansweredStarts(tab);
  starts.sends(sent);
  expect(starts.now()).toEqual([]);
  starts.settle("q");
  expect(new UnansweredStarts(tab).now()).toEqual([]);
});

test("a start without an answer is unsure, and stays so when the page is loaded again", () => {
  const tab = new Tab();
  const starts = new UnansweredStarts(tab);
  let heard = 0;
  starts.subscribe(() => {
    heard += 1;
  });
  starts.sends(sent);
  expect(new UnansweredStarts(tab).now()).toEqual([sent]); // loaded again while it waits
  starts.doubt("q");
  expect(starts.now()).toEqual([sent]);
  expect(heard).toBe(2);
  expect(new UnansweredStarts(tab).now()).toEqual([sent]);
});

test("what somebody else has put into the tab's store is no start", () => {
  const tab = new Tab();
  for (const text of ["", "{", "7", '{"a":1}', '[null, 1, {"request":"q"}]']) {
    tab.setItem("aa.starts", text);
    expect(new UnansweredStarts(tab).now()).toEqual([]);
  }
  const throws = {
    getItem: () => {
      throw new Error("forbidden");
    },
    setItem: () => {
      throw new Error("full");
    },
  };
  const starts = new UnansweredStarts(throws);
  starts.sends(sent);
  starts.doubt("q");
  expect(starts.now()).toEqual([sent]);
});

test("of a group it is told which robots have a run and which are not known", () => {
  const found = (engines: string[], under_way = false): StartFound => ({
    request_id: "q",
    under_way,
    runs: engines.map((engine) => ({ engine }) as StartFound["runs"][number]),
    queued: null,
  });
  expect(missing(sent, undefined)).toEqual(["David", "Eve"]);
  expect(unknownWords(sent, found(["Eve", "David"]), false)).toBeNull();
  const half = unknownWords(sent, found(["Eve"]), false);
  expect(half).toContain("NOT KNOWN whether v3 of patrol started on David.");
  expect(half).toContain("nothing of this start so far");
  expect(unknownWords(sent, found([], true), false)).toContain("still carrying it out");
  expect(unknownWords(sent, found([]), true)).toContain("has not answered");
});

test("of a start for the queue it is told whether it is there, and that nothing starts by it", () => {
  const waits = { does: "was put into the queue", hint: "Nothing starts by that." };
  const nothing: StartFound = { request_id: "q", under_way: false, runs: [], queued: null };
  const words = unknownWords({ ...sent, ...waits }, nothing, false);
  expect(words).toContain("NOT KNOWN whether v3 of patrol was put into the queue.");
  expect(words).toContain("Nothing starts by that.");
  const there = { ...nothing, queued: { entry: "e", waits: true } };
  expect(unknownWords({ ...sent, ...waits }, there, false)).toBeNull();
});

test("a press of the same that is sent again is one unanswered start, until it is answered", async () => {
  const lost = () => Promise.reject(new TypeError("Failed to fetch"));
  const refusal = new Refusal({ type: "conflict", title: "No", status: 409, detail: "No." });
  await expect(sendNoted(sent, lost)).rejects.toBeInstanceOf(Unanswered);
  await expect(sendNoted(sent, lost)).rejects.toBeInstanceOf(Unanswered);
  expect(unansweredStarts.now().map(({ request }) => request)).toEqual(["q"]);
  await expect(sendNoted(sent, () => Promise.reject(refusal))).rejects.toBe(refusal);
  // The first one may still be carried out.
  expect(unansweredStarts.now().map(({ request }) => request)).toEqual(["q"]);
  expect(await sendNoted(sent, () => Promise.resolve("there"))).toBe("there");
  expect(unansweredStarts.now()).toEqual([]);
  await expect(sendNoted(sent, () => Promise.reject(refusal))).rejects.toBe(refusal);
  expect(unansweredStarts.now()).toEqual([]);
});
