/** Who this browser is: trades the token of the link for a cookie. */
import { ask } from "./http";
import type { Role } from "./roles";

export { type Deed, may, ROLE_WORDS, ROLES, type Role } from "./roles";

export interface Person {
  id: string;
  name: string;
  role: Role;
}

const NAME_KEY = "aa.name";

/** The token in the address (`#t=…`), which is erased from it at once. */
export function takeToken(): string | null {
  const found = /[#&]t=([^&]+)/.exec(location.hash);
  if (!found?.[1]) return null;
  history.replaceState(history.state, "", location.pathname + location.search);
  return decodeURIComponent(found[1]);
}

export function rememberedName(): string {
  return localStorage.getItem(NAME_KEY) ?? "";
}

interface SessionAnswer {
  person: Person;
}

/** Trades a token for a session. Throws `Refusal` when it is not the server's. */
export async function openSession(token: string): Promise<Person> {
  const name = rememberedName();
  const body = name === "" ? { token } : { token, name };
  return (await ask<SessionAnswer>("/api/session", { method: "POST", body })).person;
}

/** Who the cookie says we are. Throws a `Refusal` with status 401 without one. */
export async function currentPerson(): Promise<Person> {
  return (await ask<SessionAnswer>("/api/session")).person;
}

/** The same session under another name. */
export async function rename(name: string): Promise<Person> {
  const answer = await ask<SessionAnswer>("/api/session", { method: "POST", body: { name } });
  localStorage.setItem(NAME_KEY, name);
  return answer.person;
}
