import { expect, test } from "vitest";
import { mapsFrom } from "../graph/document-keys";
import { fingerprint } from "./fingerprint";

test("the fingerprint is what the server makes", () => {
  const maps = mapsFrom({
    meta: { name: "Größe 😀", schema: 1 },
    actions: { abc: "Go", "abc|missing": false, "abc|order": -0 },
    positions: { abc: [1.5, -2] },
    comments: { "t/1": null },
  });
  expect(fingerprint(maps)).toEqual({ entries: 7, total: 10955581501 });
  expect(fingerprint(mapsFrom({}))).toEqual({ entries: 0, total: 0 });
});

test.each([
  { meta: { name: "b" } },
  { meta: { nama: "a" } },
  { actions: { name: "a" } },
  { meta: { name: true } },
  { meta: { name: 1 } },
  { meta: { name: "a", more: "a" } },
  {},
])("%j has another fingerprint", (other) => {
  expect(fingerprint(mapsFrom(other))).not.toEqual(fingerprint(mapsFrom({ meta: { name: "a" } })));
});
