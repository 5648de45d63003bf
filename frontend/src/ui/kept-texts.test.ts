// @vitest-environment jsdom
import { afterEach, expect, test, vi } from "vitest";

const load = async () => {
  vi.resetModules(); // as a reload of the page does
  const { keptTexts, textScope, startScope } = await import("./kept-texts");
  const { pendingDrafts } = await import("./drafts");
  return { keptTexts, textScope, startScope, pendingDrafts };
};

afterEach(() => {
  vi.restoreAllMocks();
  sessionStorage.clear();
});

test("a text that waits for its button survives a reload, for its person only", async () => {
  const { keptTexts, textScope } = await load();
  const ada = textScope("g1", "ada");
  keptTexts.set(`${ada}comment/a1`, "half a comment");
  const again = (await load()).keptTexts;
  expect(again.get(`${ada}comment/a1`)).toBe("half a comment");
  expect([again.count(ada), again.count(textScope("g1", "bob"))]).toEqual([1, 0]);
  again.set(`${ada}comment/a1`, "");
  expect((await load()).keptTexts.count(ada)).toBe(0);
});

test("what is typed for a start is kept, and no draft of the graph", async () => {
  const { keptTexts, textScope, startScope } = await load();
  keptTexts.set(`${startScope("g1", "ada")}repeat`, "0.2");
  expect(keptTexts.count(textScope("g1", "ada"))).toBe(0);
  expect((await load()).keptTexts.get(`${startScope("g1", "ada")}repeat`)).toBe("0.2");
});

test("a text that the tab does not keep is a draft of this page, so its person is asked", async () => {
  const { keptTexts, pendingDrafts } = await load();
  vi.spyOn(Storage.prototype, "setItem").mockImplementation(() => {
    throw new DOMException("full", "QuotaExceededError");
  });
  keptTexts.set("g1/ada/json", "{}");
  expect(keptTexts.get("g1/ada/json")).toBe("{}");
  expect(pendingDrafts.counts()).toEqual({ writing: 0, waiting: 1 });
  const leaving = new Event("beforeunload", { cancelable: true });
  window.dispatchEvent(leaving);
  expect(leaving.defaultPrevented).toBe(true);
  keptTexts.set("g1/ada/json", "");
  expect(pendingDrafts.counts()).toEqual({ writing: 0, waiting: 0 });
});
