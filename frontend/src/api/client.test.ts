import { expect, test, vi } from "vitest";
import { editor, runnerAt } from "./client";
import { Refusal } from "./http";

/** Answer each request in this way, and return the requests: method, address and body. */
function server(status: number, body: unknown): string[] {
  const asked: string[] = [];
  vi.stubGlobal("fetch", async (url: string, init: RequestInit) => {
    asked.push(`${init.method} ${url} ${init.body ?? ""}`.trim());
    return new Response(body === null ? null : JSON.stringify(body), { status });
  });
  return asked;
}

test("path parameters and queries are escaped, and a parameter without a value is left out", async () => {
  const asked = server(200, []);
  const path = { graph_id: "a/b?c" };
  await editor.get("/api/graphs/{graph_id}/history", { path, query: { limit: 5, before: null } });
  await runnerAt("http://lab:8001").get("/api/runs", {
    query: { text: "a&b c", label: undefined },
  });
  await editor.get("/api/actions/{action_id}/uses", {
    path: { action_id: "1" },
    query: new URLSearchParams([
      ["inputs", "a:b"],
      ["inputs", "c:d"],
    ]),
  });
  expect(asked).toEqual([
    "GET /api/graphs/a%2Fb%3Fc/history?limit=5",
    "GET http://lab:8001/api/runs?text=a%26b+c",
    "GET /api/actions/1/uses?inputs=a%3Ab&inputs=c%3Ad",
  ]);
});

test("the text of a file is sent as it is", async () => {
  const asked = server(201, { id: "g" });
  const text = '{"graph_name": "a", "rate": 5.0}';
  expect(await editor.post("/api/graphs", { body: text, status: 201 })).toEqual({ id: "g" });
  await editor.post("/api/graphs", { body: { name: "b" } });
  expect(asked).toEqual([`POST /api/graphs ${text}`, 'POST /api/graphs {"name":"b"}']);
});

test("an answer with another status than the wanted one is no answer", async () => {
  server(201, { id: "g" });
  const preview = editor.post("/api/graphs", {
    query: { preview: true },
    body: "{}",
    status: 200,
  });
  await expect(preview).rejects.toThrow("The server answered 201 instead of 200.");
});

test("an answer without a body is undefined, and a refusal is thrown with its reason", async () => {
  server(204, null);
  expect(
    await editor.delete("/api/graphs/{graph_id}", { path: { graph_id: "g" } }),
  ).toBeUndefined();
  server(409, { type: "conflict", title: "Conflict", status: 409, detail: "It has ended." });
  const paused = runnerAt("").post("/api/runs/{run}/pause", { path: { run: "r" } });
  await expect(paused).rejects.toThrow(Refusal);
  await expect(paused).rejects.toThrow("It has ended.");
});
