import { expect, test } from "vitest";
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
const refused = () =>
  Promise.reject(new Refusal({ type: "conflict", title: "No", status: 409, detail: "No." }));

test("a press whose answer got lost has the same request id when it is made again, and another one its own", async () => {
  const first = await pressed(order, lost);
  expect(first.end).toBe("NotKnown");
  const other = await pressed({ ...order, engines: ["Carol"] }, () => Promise.resolve("there"));
  const again = await pressed(order, () => Promise.resolve("there"));
  expect([again.request, again.end]).toEqual([first.request, "there"]);
  expect(other.request).not.toBe(first.request);
  const next = await pressed(order, refused);
  expect(next.end).toBe("Refusal");
  expect(next.request).not.toBe(first.request);
  expect((await pressed(order, refused)).request).not.toBe(next.request);
});
