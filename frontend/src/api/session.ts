/** Session of this browser: trades the token of the link for a cookie. */
import { editor, runnerAt } from "./client";
import { errorText, Refusal } from "./http";
import type { EditorApi } from "./schema/editor";

/** `personal`: an owner has given the name, since the person came by a personal link. */
export type Person = EditorApi["Person"] & { readonly personal?: boolean };

const NAME_KEY = "aa.name";

/**
 * Credential for signing in: the server's token, an invitation (`ID.SECRET`), or the code that another
 * device of the person shows.
 */
export interface Credential {
  readonly kind: "token" | "invitation" | "device";
  readonly text: string;
}

const KINDS = { t: "token", i: "invitation", d: "device" } as const;

/** The key in a link or a fragment; null when it has none. */
export function credentialIn(link: string): Credential | null {
  const found = /[#&]([tid])=([^&\s]+)/.exec(link);
  if (!found?.[1] || !found[2]) return null;
  const text = decodeURIComponent(found[2]);
  return { kind: KINDS[found[1] as keyof typeof KINDS], text };
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

const PERSON_KEY = "aa.person";

/** Returns the person whose pages this device may show while no server answers; null if nobody is signed in. */
export function rememberedPerson(): Person | null {
  try {
    const kept: unknown = JSON.parse(localStorage.getItem(PERSON_KEY) ?? "null");
    return isPerson(kept) ? kept : null;
  } catch {
    return null;
  }
}

function isPerson(kept: unknown): kept is Person {
  if (typeof kept !== "object" || kept === null) return false;
  const { id, name, role } = kept as Partial<Record<keyof Person, unknown>>;
  return typeof id === "string" && typeof name === "string" && String(role) in ROLE_WORDS;
}

/** Returns a text that is another one when the runner takes somebody for another person, name or role. */
export function identityOf({ id, role, name }: Person): string {
  return `${id} ${role} ${name}`;
}

/** Stores who is signed in, for a page that opens without a server; null: nobody is shown anything then. */
export function rememberPerson(person: Person | null): void {
  localStorage.removeItem(PERSON_KEY);
  if (person === null) return;
  try {
    localStorage.setItem(PERSON_KEY, JSON.stringify(person));
  } catch {
    // A device that stores nothing still knows them until the page is loaded anew.
  }
}

/** Role that an invitation gives, and who made it. */
export type InvitationPreview = EditorApi["Invited"];

/** Throws `Refusal` when the link is none of this server, or was revoked. */
export function readInvitation(invitation: string): Promise<InvitationPreview> {
  return editor.post("/api/session/invitation", { body: { invitation } });
}

/** Trades a key for a session. Throws `Refusal` when it does not fit. */
export async function openSession(key: Credential, name = rememberedName()): Promise<Person> {
  const body = { [key.kind]: key.text, ...(name !== "" && { name }) };
  return personIn(await editor.post("/api/session", { body }));
}

export const personIn = ({ person, personal }: EditorApi["SignedIn"]): Person => ({
  ...person,
  personal,
});

const DEVICE_LOOK = 1_000; // ms between two questions whether this device is confirmed

/**
 * Signs this device in by the code that another one shows. Calls `onWaiting` with the number that both
 * show, and waits until the person has confirmed it there. Throws `Refusal` if they do not.
 */
export async function signInByCode(
  code: string,
  onWaiting: (waiting: EditorApi["WaitingDevice"]) => void,
): Promise<Person> {
  const waiting = await editor.post("/api/session/device", { body: { code } });
  onWaiting(waiting);
  for (;;) {
    const body = { claim: waiting.claim };
    const { signed_in } = await editor.post("/api/session/device/answer", { body });
    if (signed_in) return personIn(signed_in);
    await new Promise((resolve) => setTimeout(resolve, DEVICE_LOOK));
  }
}

/** Return the person of the cookie. Throws a `Refusal` with status 401 without one. */
export async function currentPerson(timeoutMs = 20_000): Promise<Person> {
  return personIn(await editor.get("/api/session", { timeoutMs }));
}

const FAREWELL_KEY = "aa.farewell";

/**
 * Ends the session at the editor, and at a runner that has a data folder of its own. Where they share
 * one, either does for both; the page cannot know, so that of one which was not told it is said
 * afterwards (`takeFarewell`). Throws when neither could.
 */
export async function signOut(runner: string | undefined): Promise<void> {
  const [editor, other] = await Promise.allSettled([
    endSession("The editor", ""),
    runner === undefined ? lostRunner() : endSession("The runner", runner),
  ]);
  if (editor.status === "rejected" && other.status === "rejected") throw editor.reason;
  rememberPerson(null);
  const failed = [editor, other].find((each) => each.status === "rejected");
  if (failed !== undefined) sessionStorage.setItem(FAREWELL_KEY, errorText(failed.reason));
}

/** End the session on one server; a session that has ended already is no error. */
async function endSession(who: string, place: string): Promise<void> {
  try {
    await runnerAt(place).delete("/api/session", {});
  } catch (error) {
    if (error instanceof Refusal && error.details.status === 401) return;
    throw new Error(`${who} could not end this session: ${errorText(error)} ${OWN_FOLDER}`);
  }
}

function lostRunner(): Promise<never> {
  return Promise.reject(new Error(`The page did not find the runner. ${OWN_FOLDER}`));
}

const OWN_FOLDER =
  "If it has a data folder of its own, it goes on to take a copy of this session’s cookie for valid.";

/** Return, only once, what could not be done when this browser signed out last. */
export function takeFarewell(): string {
  const said = sessionStorage.getItem(FAREWELL_KEY) ?? "";
  sessionStorage.removeItem(FAREWELL_KEY);
  return said;
}

/** Continue the session under another name. */
export async function renamePerson(name: string): Promise<Person> {
  const answer = await editor.post("/api/session", { body: { name } });
  rememberName(name);
  return personIn(answer);
}

export type Role = EditorApi["Person"]["role"];

/** From the least to the most; each may do what those before it may. */
const ROLES = ["viewer", "editor", "operator", "owner"] as const satisfies readonly Role[];

/** The least role for each permission, as in the server's `web/auth/roles.py`; a test compares them. */
const FROM = {
  see: "viewer",
  stop: "viewer",
  edit: "editor",
  simulate: "editor",
  operate: "operator",
  register: "operator",
  share: "owner",
  restore: "owner",
  scrape: "viewer",
} as const satisfies Record<string, Role>;

export type Permission = keyof typeof FROM;

export function may(role: Role, permission: Permission): boolean {
  return ROLES.indexOf(role) >= ROLES.indexOf(FROM[permission]);
}

/** Permissions of each role in words that follow "may". */
export const ROLE_WORDS: Readonly<Record<Role, string>> = {
  viewer: "look at everything and stop runs",
  editor: "edit graphs, run them in the simulator, and stop runs",
  operator: "edit graphs, run them on robots, and stop runs",
  owner: "do everything",
};
