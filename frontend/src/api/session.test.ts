import { afterEach, expect, test, vi } from "vitest";
import { rememberedPerson, rememberPerson, signOut, takeFarewell } from "./session";

const RUNNER = "http://lab:8001";
const answer = (status: number) => () => Promise.resolve(new Response(null, { status }));
const away = () => Promise.reject(new TypeError("Failed to fetch"));

/** Return the list of requests, with an editor and a runner that answer in this way. */
function servers(editor: () => Promise<Response>, runner: () => Promise<Response>): string[] {
  const asked: string[] = [];
  vi.stubGlobal("fetch", (url: string, init: RequestInit) => {
    asked.push(`${init.method} ${url}`);
    return url.startsWith(RUNNER) ? runner() : editor();
  });
  return asked;
}

const store = new Map<string, string>();
const storage = {
  getItem: (key: string) => store.get(key) ?? null,
  setItem: (key: string, value: string) => store.set(key, value),
  removeItem: (key: string) => store.delete(key),
};
vi.stubGlobal("sessionStorage", storage);
vi.stubGlobal("localStorage", storage);

afterEach(() => store.clear());

test("a session is ended at the editor and at the runner", async () => {
  const asked = servers(answer(204), answer(204));
  await signOut(RUNNER);
  expect(asked.sort()).toEqual(["DELETE /api/session", `DELETE ${RUNNER}/api/session`]);
  expect(takeFarewell()).toBe("");
});

test("one that finds the session ended by the other has nothing to do", async () => {
  servers(answer(204), answer(401));
  await signOut(RUNNER);
  expect(takeFarewell()).toBe("");
});

test("a runner that is away keeps nobody in, and that it was not told is said once", async () => {
  servers(answer(204), away);
  await signOut(RUNNER);
  const said = takeFarewell();
  expect(said).toContain("The runner could not end this session: The runner does not answer.");
  expect(said).toContain("data folder of its own");
  expect(takeFarewell()).toBe("");
});

test("so is that the page does not know where the runner is, and that the editor is away", async () => {
  servers(answer(204), away);
  await signOut(undefined);
  expect(takeFarewell()).toContain("did not find the runner");
  servers(away, answer(204));
  await signOut(RUNNER);
  expect(takeFarewell()).toContain("The editor could not end this session");
});

test("where neither could the page stays as it is", async () => {
  servers(away, away);
  await expect(signOut(RUNNER)).rejects.toThrow("The editor could not end this session");
  expect(takeFarewell()).toBe("");
});

test("who was here last may see what the device keeps, until they sign out", async () => {
  expect(rememberedPerson()).toBeNull();
  const ada = { id: "p", name: "Ada", role: "editor" } as const;
  rememberPerson(ada);
  expect(rememberedPerson()).toEqual(ada);
  servers(answer(204), answer(204));
  await signOut(RUNNER);
  expect(rememberedPerson()).toBeNull();
  for (const odd of ["no JSON", "{}", '{"id":"p","name":"Ada","role":"king"}', "[]"]) {
    store.set("aa.person", odd);
    expect(rememberedPerson()).toBeNull();
  }
});

test("a device that stores nothing remembers nobody, and not the person before", () => {
  const ada = { id: "a", name: "Ada", role: "viewer", personal: false } as const;
  rememberPerson(ada);
  vi.stubGlobal("localStorage", {
    ...storage,
    setItem: () => {
      throw new DOMException("full", "QuotaExceededError");
    },
  });
  rememberPerson({ ...ada, id: "b", name: "Ben" });
  expect(rememberedPerson()).toBeNull();
  vi.stubGlobal("localStorage", storage);
});
