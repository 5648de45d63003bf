import { expect, test } from "vitest";
import { versionIn } from "./page-version";
import { handlingOf, isServerGone, outdated, storeName } from "./requests";

const SCOPE = "https://robots.example/temoto/";
const asked = (path: string, mode = "cors", method = "GET") =>
  handlingOf({ method, mode, url: new URL(path, SCOPE).href }, SCOPE);

test("answers of the API and the help are never the worker's, however they are asked for", () => {
  for (const path of [
    "api/graphs",
    "runner/api/runs",
    "healthz",
    "metrics",
    "help",
    "help/",
    "view",
  ]) {
    for (const mode of ["cors", "navigate", "no-cors"]) expect(asked(path, mode)).toBe("pass");
  }
});

test("Start and Stop pass the worker: it sends nothing, and nothing later", () => {
  expect(asked("api/stop", "cors", "POST")).toBe("pass");
  expect(asked("runner/api/runs", "cors", "POST")).toBe("pass");
  expect(asked("", "navigate", "POST")).toBe("pass");
});

test("the page is one page at each of its addresses, below its own path only", () => {
  for (const path of ["", "graphs/abc?action=x", "runs", "robots#here"]) {
    expect(asked(path, "navigate")).toBe("page");
  }
  expect(asked("/elsewhere", "navigate")).toBe("pass");
  expect(asked("https://other.example/temoto/", "navigate")).toBe("pass");
  expect(asked("assets/index-abc.js")).toBe("part");
  expect(asked("mark.svg", "no-cors")).toBe("sign");
  // Only the server is asked for a newer page.
  expect(asked("")).toBe("pass");
});

test("a proxy without its server is no answer; a refusal is one", () => {
  expect([502, 503, 504].every(isServerGone)).toBe(true);
  expect([200, 304, 401, 403, 404, 500].some(isServerGone)).toBe(false);
});

test("pages of the version before keep their parts; older ones go", () => {
  const stores = ["other", ...["1", "2", "3"].map(storeName)];
  expect(outdated(stores, "3")).toEqual([storeName("1")]);
  expect(outdated(stores.slice(0, 2), "1")).toEqual([]);
  expect(outdated([...stores, storeName("4")], "4")).toEqual([storeName("1"), storeName("2")]);
});

test("the version of a page is read from what the server sends", () => {
  expect(versionIn('<head><meta name="build" content="abc123" /></head>')).toBe("abc123");
  expect(versionIn("<!doctype html>")).toBe("");
});

test("what another runner serves below the public address is no page of it", () => {
  const at = (path: string) =>
    handlingOf(
      { method: "GET", mode: "navigate", url: `https://x/temoto/${path}` },
      "https://x/temoto/",
    );
  for (const base of ["hall-b", "halls/b", "lab/halls/b"]) {
    expect(at(`${base}/api/runs/a/export?format=jsonl`)).toBe("pass");
    expect(at(`${base}/healthz`)).toBe("pass");
  }
  expect(at("runs/api")).toBe("page");
});
