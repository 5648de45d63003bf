// @vitest-environment jsdom
import fc from "fast-check";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test } from "vitest";
import type { Run, Visit } from "../../api/runs";
import { HandOverLines, handOversOf, handOverTime } from "./hand-overs";
import type { Lane } from "./lanes";

const at = (ms: number) => new Date(ms).toISOString();
const visit = (from: number, until: number | null, slack = 0): Visit => ({
  not_before: at(from - slack),
  from: at(from),
  until: until === null ? null : at(until),
  not_after: until === null ? null : at(until + slack),
  result: "true",
  how: "observed",
  inputs: null,
});
const lane = (name: string, robot: string, more: Partial<Lane> = {}): Lane => ({
  ...{ name, label: name, aid: name, robot, levels: [], around: null, holds: false, ...more },
});
const needs = (...parents: string[]) => ({
  needs: { parents, others: [{ key: "Drive", words: "Carrier: Drive" }] },
});
const runOf = (actions: Record<string, Visit[]>) =>
  ({
    actions: Object.fromEntries(
      Object.entries(actions).map(([name, visits]) => [name, { visits }]),
    ),
  }) as unknown as Run;
const LANES = [lane("Drive", "Carol"), lane("Look", "David", needs("Drive"))];

test("the time runs from the end of the one to the begin of the other", () => {
  const found = handOversOf(runOf({ Drive: [visit(0, 1000)], Look: [visit(1016, 2000)] }), LANES);
  expect(found).toMatchObject([{ from: "Drive", to: "Look", least: 16, most: 16 }]);
  expect(found.map(handOverTime)).toEqual(["16 ms"]);
});

test("each lap has its own, and one without a new end has none", () => {
  const Drive = [visit(0, 1000), visit(3000, 4000)];
  const Look = [visit(1010, 2000), visit(4030, 5000), visit(6000, 7000)];
  const found = handOversOf(runOf({ Drive, Look }), LANES);
  expect(found.map(({ most }) => most)).toEqual([10, 30]);
});

test("an end that was not seen is no hand-over, nor one that came after the begin", () => {
  const Look = [visit(1010, 2000)];
  expect(handOversOf(runOf({ Drive: [visit(0, null)], Look }), LANES)).toEqual([]);
  const open = { ...visit(0, 1000), not_after: null };
  expect(handOversOf(runOf({ Drive: [open], Look }), LANES)).toEqual([]);
  expect(handOversOf(runOf({ Drive: [visit(0, 1500)], Look }), LANES)).toEqual([]);
});

test("what ended last counts: an action of the own robot is no hand-over", () => {
  const lanes = [lane("Drive", "Carol"), lane("Look", "David", needs("Drive", "Turn"))];
  const actions = { Drive: [visit(0, 1000)], Look: [visit(1500, 2000)] };
  expect(handOversOf(runOf({ ...actions, Turn: [visit(0, 1400)] }), lanes)).toEqual([]);
  expect(handOversOf(runOf({ ...actions, Turn: [visit(0, 900)] }), lanes)).toHaveLength(1);
  expect(handOversOf(runOf({ ...actions, Turn: [visit(0, null)] }), lanes)).toEqual([]);
});

test("bounds hold for every moment at which both may have been", () => {
  const ms = fc.integer({ min: 0, max: 500 });
  fc.assert(
    fc.property(ms, ms, ms, ms, (slack, gap, early, late) => {
      const Drive = [visit(1000, 3000, slack)];
      const Look = [visit(3000 + gap, 9000, slack)];
      const [found] = handOversOf(runOf({ Drive, Look }), LANES);
      if (found === undefined) throw new Error("no hand-over");
      const ended = 3000 + Math.min(early, slack);
      const began = 3000 + gap - Math.min(late, slack);
      if (began < ended) return;
      expect(found.least).toBeLessThanOrEqual(began - ended);
      expect(found.most).toBeGreaterThanOrEqual(began - ended);
    }),
  );
  expect(handOverTime({ least: 0, most: 39.2 })).toBe("≤ 40 ms");
  expect(handOverTime({ least: 12.3, most: 40 })).toBe("12–40 ms");
});

test("lines are drawn also on a page that is opened while the run goes on", async () => {
  const run = runOf({ Drive: [visit(0, 1000)], Look: [visit(1016, 2000)] });
  const overs = handOversOf(run, LANES);
  const page = document.body.appendChild(document.createElement("div"));
  const root = createRoot(page);
  await act(async () =>
    root.render(
      <ul>
        {LANES.map(({ name }) => (
          <li key={name} data-lane={name} />
        ))}
        <HandOverLines overs={overs} axis={{ start: 0, span: 4000 }} lanes={LANES} />
      </ul>,
    ),
  );
  expect(page.querySelector("i")?.title).toBe("began 16 ms after Carrier: Drive had ended");
  await act(async () => root.unmount());
});
