import { expect, test, vi } from "vitest";
import * as Y from "yjs";
import { setGraphName } from "../graph/edit";
import { FakeEditStore } from "../testing/fake-device";
import { madeNow } from "./indexed-db";
import { keptGraphs, leaveDevice } from "./kept-graphs";

const NOTHING = { waits: [], known: [], durable: [], copy: null, seq: 1 };

async function device(): Promise<FakeEditStore> {
  const store = new FakeEditStore();
  for (const [graph, id, waits] of [
    ["saved", "ada", false],
    ["unsaved", "ada", true],
    ["other", "mari", false],
  ] as const) {
    const doc = new Y.Doc();
    setGraphName(doc, `Graph ${graph}`);
    const update = Y.encodeStateAsUpdate(doc);
    const batch = waits ? { waits: [madeNow(update, [])] } : { known: [update] };
    await store.write({ graph, person: { id, name: id } }, "e", { ...NOTHING, ...batch });
  }
  return store;
}

test("a device lists the graphs of one person, with what waits, and nobody else's", async () => {
  const found = await keptGraphs("ada", await device());
  expect(found.map(({ name, waiting }) => [name, waiting])).toEqual([
    ["Graph unsaved", 1],
    ["Graph saved", 0],
  ]);
});

test("signing out leaves no copy behind and loses no edit", async () => {
  const store = await device();
  await leaveDevice("ada", store);
  expect((await keptGraphs("ada", store)).map(({ name }) => name)).toEqual(["Graph unsaved"]);
  expect(await keptGraphs("mari", store)).toHaveLength(1);
  vi.spyOn(console, "warn").mockImplementation(() => {});
  store.refuses = true;
  await leaveDevice("ada", store);
});
