/** The order of rows over both logs, and the files. */
import fc from "fast-check";
import { expect, test } from "vitest";
import {
  type AuditRow,
  auditFilterOf,
  auditQueryOf,
  csvOf,
  droppedText,
  mergedRows,
} from "./audit-log";

function row(log: string, position: number, at: number): AuditRow {
  const time = new Date(at).toISOString();
  return { id: `${log}:${position}`, position, at: time, kind: "edits", event: "e", text: "t" };
}

/** A log whose rows have rising times, read back to some row. */
const LOG = fc.array(fc.integer({ min: 0, max: 50 }), { maxLength: 20 }).chain((times) => {
  const sorted = times.sort((a, b) => a - b);
  return fc.record({
    times: fc.constant(sorted),
    read: fc.integer({ min: 0, max: sorted.length }),
  });
});

test("no row stands before a row that comes with the next page", () => {
  fc.assert(
    fc.property(LOG, LOG, (editor, runner) => {
      const all = { editor, runner };
      const rowsOf = (name: "editor" | "runner") =>
        all[name].times.map((at, i) => row(name, i + 1, at * 1000)).reverse();
      const logs = (["editor", "runner"] as const).map((name) => {
        const rows = rowsOf(name).slice(0, all[name].read);
        const isWhole = all[name].read === all[name].times.length;
        const oldest = rows.at(-1);
        const backTo = isWhole ? 0 : oldest ? Date.parse(oldest.at) : Number.POSITIVE_INFINITY;
        return { rows, backTo, problem: null };
      });
      const shown = mergedRows(logs);
      const times = shown.map(({ at }) => Date.parse(at));
      expect(times).toEqual([...times].sort((a, b) => b - a));
      const ids = new Set(shown.map(({ id }) => id));
      const last = times.at(-1);
      const missing = [...rowsOf("editor"), ...rowsOf("runner")].filter(({ id }) => !ids.has(id));
      for (const { at } of missing) {
        if (last !== undefined) expect(Date.parse(at)).toBeLessThanOrEqual(last);
      }
    }),
  );
});

test("the log of a process that does not answer holds up nothing", () => {
  const away = {
    rows: [],
    backTo: Number.POSITIVE_INFINITY,
    problem: "The runner does not answer.",
  };
  const editor = { rows: [row("editor", 2, 5_000)], backTo: 0, problem: null };
  expect(mergedRows([editor, away]).map(({ id }) => id)).toEqual(["editor:2"]);
});

test("no cell of the CSV begins as a formula does", () => {
  const evil = { ...row("editor", 1, 0), text: '=1+1, "quoted"', person: { id: "-2", name: "@x" } };
  const lines = csvOf([evil]).split("\r\n");
  expect(lines[1]).toBe(
    `1970-01-01T00:00:00.000Z,editor:1,edits,e,'@x,'-2,"'=1+1, ""quoted""",,,,,,,,,`,
  );
});

test("a filter in the address of the page is the same filter again", () => {
  const filter = auditFilterOf(new URLSearchParams("person=p1&kind=stops,starts&since=2026-11-28"));
  expect(auditFilterOf(auditQueryOf(filter))).toEqual(filter);
  expect(auditQueryOf(auditFilterOf(new URLSearchParams(""))).toString()).toBe("");
});

test("a sentence says which rows were dropped, when, and by which setting", () => {
  const dropped = { until: "2026-05-31T23:59:00Z", at: "2026-11-28T10:00:00Z", days: 90 };
  expect(droppedText("runner", dropped)).toBe(
    "The runner keeps for 90 days what only the audit has, such as sign-ins and refusals: " +
      "such rows up to 2026-05-31 were dropped on 2026-11-28.",
  );
});
