// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act, type ComponentType } from "react";
import { createRoot } from "react-dom/client";
import { afterEach, beforeAll, expect, test, vi } from "vitest";
import { standInForBrowser } from "../testing/browser";
import { lazyPart, PartBoundary, preloadParts } from "./lazy-part";

beforeAll(() => {
  standInForBrowser();
});
afterEach(() => vi.restoreAllMocks());

const Word = ({ word }: { word: string }) => <p>{word}</p>;

/** Draws a part as a page does; what is written then. */
async function drawn(Part: ComponentType<{ word: string }>): Promise<string> {
  const place = document.createElement("div");
  const root = createRoot(place);
  await act(async () =>
    root.render(
      <MantineProvider>
        <PartBoundary frame={(notice) => <main>STOP {notice}</main>}>
          <Part word="here" />
        </PartBoundary>
      </MantineProvider>,
    ),
  );
  const read = place.querySelector("main, p");
  const text = read?.textContent?.trim() ?? "";
  await act(async () => root.unmount());
  return text;
}

test("what is not there yet is said inside of what is", async () => {
  let arrive = () => {};
  const Part = lazyPart<{ word: string }>(
    () =>
      new Promise((resolve) => {
        arrive = () => resolve(Word);
      }),
  );
  const said = await drawn(Part);
  arrive();
  expect(said).toBe("STOP Loading …");
  await Part.preload();
  expect(await drawn(Part)).toBe("here");
});

test("a part that does not arrive is said, and asked for again by the next one", async () => {
  vi.spyOn(console, "error").mockImplementation(() => {});
  let times = 0;
  const Part = lazyPart<{ word: string }>(async () => {
    times += 1;
    if (times === 1) throw new TypeError("Failed to fetch dynamically imported module");
    return Word;
  });
  const said = await drawn(Part);
  expect(said).toMatch(/^STOP This part of the page did not load/);
  expect(said).toContain("wait on this device");
  expect(said).toContain("Reload the page");
  expect(await drawn(Part)).toBe("here");
  expect(times).toBe(2);
});

test("idle pages load what may be needed next, newest first, and what is heavy never", async () => {
  const loaded: string[] = [];
  const part =
    (name: string, inner = () => {}) =>
    async () => {
      loaded.push(name);
      inner();
      return Word;
    };
  lazyPart(part("other screen"));
  lazyPart(part("screen", () => lazyPart(part("dialog"))));
  lazyPart(part("json editor"), { heavy: true });
  await preloadParts(async () => {});
  expect(loaded).toEqual(["screen", "dialog", "other screen"]);
});
