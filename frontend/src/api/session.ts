/** Who this browser is: trades the token of the link for a cookie. */
import { fetchJson } from "./http";
import type { EditorApi } from "./schema/editor";

export { may, type Permission, ROLE_WORDS, ROLES, type Role } from "./roles";

export type Person = EditorApi["Person"];

const NAME_KEY = "aa.name";

/** What signs somebody in: the server's token, or an invitation (`ID.SECRET`). */
export type Credential =
  | { readonly kind: "token"; readonly text: string }
  | { readonly kind: "invitation"; readonly text: string };

/** The key in a link or a fragment; null when it has none. */
export function credentialIn(link: string): Credential | null {
  const found = /[#&](t|i)=([^&\s]+)/.exec(link);
  if (!found?.[1] || !found[2]) return null;
  const text = decodeURIComponent(found[2]);
  return { kind: found[1] === "t" ? "token" : "invitation", text };
}

/** The key in the address, which is erased from it at once. */
export function takeCredential(): Credential | null {
  const key = credentialIn(location.hash);
  if (key !== null) {
    history.replaceState(history.state, "", location.pathname + location.search);
  }
  return key;
}

export function rememberName(name: string): void {
  localStorage.setItem(NAME_KEY, name);
}

export function rememberedName(): string {
  return localStorage.getItem(NAME_KEY) ?? "";
}

type SessionAnswer = EditorApi["SignedIn"];
/** What a link invites to, and by whom. */
export type InvitationPreview = EditorApi["Invited"];

/** Throws `Refusal` when the link is none of this server, or was revoked. */
export function readInvitation(invitation: string): Promise<InvitationPreview> {
  return fetchJson("/api/session/invitation", { method: "POST", body: { invitation } });
}

/** Trades a key for a session. Throws `Refusal` when it does not fit. */
export async function openSession(key: Credential, name = rememberedName()): Promise<Person> {
  const body = { [key.kind]: key.text, ...(name !== "" && { name }) };
  return (await fetchJson<SessionAnswer>("/api/session", { method: "POST", body })).person;
}

/** Who the cookie says we are. Throws a `Refusal` with status 401 without one. */
export async function currentPerson(): Promise<Person> {
  return (await fetchJson<SessionAnswer>("/api/session")).person;
}

/** Ends the session at the editor, and at a runner that has a data folder of its own: each ends it by
 * itself, so one that cannot be reached is told by the other. Throws when neither could. */
export async function signOut(runner: string | undefined): Promise<void> {
  const places = ["", ...(runner === undefined ? [] : [runner])];
  const told = places.map((place) => fetchJson(`${place}/api/session`, { method: "DELETE" }));
  const outcomes = await Promise.allSettled(told);
  const failed = outcomes.find((each) => each.status === "rejected");
  if (failed && !outcomes.some((each) => each.status === "fulfilled")) throw failed.reason;
}

/** The same session under another name. */
export async function renamePerson(name: string): Promise<Person> {
  const answer = await fetchJson<SessionAnswer>("/api/session", { method: "POST", body: { name } });
  rememberName(name);
  return answer.person;
}
