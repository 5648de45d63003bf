import { expect, test, vi } from "vitest";
import { Refusal } from "../../api/http";
import type { StartOrder } from "../../api/runs";
import { sendLookedAt } from "./looked-at";
import type { LookedAtOrder } from "./use-start";

const order: LookedAtOrder = {
  ...{ runner: "http://runner", version: "v", digest: "d", umrf: "{}", graph: "g" },
  engines: ["David"],
};

/** Sends a press whose answer this is, and returns its request id and how it ended. */
async function pressed(of: LookedAtOrder, answer: () => Promise<string>) {
  let request = "";
  const send = (each: StartOrder) => {
    request = each.request;
    return answer();
  };
  const end = await sendLookedAt("queue", of, send).catch((error: Error) => error.constructor.name);
  return { request, end };
}

const lost = () => Promise.reject(new TypeError("Failed to fetch"));
const refused = (path?: string, kind = Refusal) =>
  Promise.reject(
    new kind({
      ...{ type: "conflict", title: "No", status: 409, detail: "No." },
      ...(path === undefined ? {} : { where: { path } }),
    }),
  );

test("a press whose answer got lost has the same request id when it is made again, and another one its own", async () => {
  const first = await pressed(order, lost);
  expect(first.end).toBe("NotKnown");
  const other = await pressed({ ...order, engines: ["Carol"] }, () => Promise.resolve("there"));
  const again = await pressed(order, () => Promise.resolve("there"));
  expect([again.request, again.end]).toEqual([first.request, "there"]);
  expect(other.request).not.toBe(first.request);
  const next = await pressed(order, () => refused());
  expect(next.end).toBe("Refusal");
  expect(next.request).not.toBe(first.request);
  expect((await pressed(order, () => refused())).request).not.toBe(next.request);
});

test("a press whose answer got lost has the same request id after the page was loaded again, until it is over", async () => {
  const kept = new Map<string, string>();
  const sessionStorage = {
    getItem: (key: string) => kept.get(key) ?? null,
    setItem: (key: string, text: string) => void kept.set(key, text),
    removeItem: (key: string) => void kept.delete(key),
  };
  vi.stubGlobal("sessionStorage", sessionStorage);
  let leave = () => {};
  vi.stubGlobal("addEventListener", (name: string, heard: () => void) => {
    if (name === "pagehide") leave = heard;
  });
  /** Loads the page again, with these presses handed over if any are given, and presses. */
  async function loaded(
    answer: (kind: typeof Refusal) => Promise<string>,
    handedOver?: string,
  ): Promise<string> {
    leave();
    if (handedOver !== undefined) kept.set("aa.presses", handedOver);
    vi.resetModules();
    const page = await import("./looked-at");
    const http = await import("../../api/http");
    let request = "";
    const send = (each: StartOrder) => {
      request = each.request;
      return answer(http.Refusal);
    };
    const whole = { ...order, inside: { subgraphs: [], tree_digest: "t" } };
    await page.sendLookedAt("queue", whole, send).catch(() => undefined);
    return request;
  }
  const first = await loaded(lost);
  expect(await loaded(lost)).toBe(first);
  expect(await loaded((kind) => refused("/start", kind))).toBe(first); // the first may still be carried out
  expect(await loaded((kind) => refused("/start/request_id", kind))).toBe(first);
  const next = await loaded(() => Promise.resolve("there"));
  expect(next).not.toBe(first);
  expect(await loaded(() => Promise.resolve("there"))).not.toBe(next);
  for (const damaged of ["{", "7", "null"]) {
    expect(await loaded(() => Promise.resolve("there"), damaged)).not.toBe("");
  }
  vi.unstubAllGlobals();
});
