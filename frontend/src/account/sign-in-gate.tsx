/** Lets the page in only with a session, and knows whose it is. */

import { IconPlugConnectedX } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useCallback, useEffect, useLayoutEffect, useMemo, useState } from "react";
import { errorText, isOutcomeUnknown, Refusal, sessionEnd } from "../api/http";
import { pageLink } from "../api/page-link";
import { basePath } from "../api/page-url";
import { PersonContext } from "../api/people";
import {
  type Credential,
  credentialIn,
  currentPerson,
  type InvitationPreview,
  openSession,
  type Person,
  readInvitation,
  rememberedName,
  rememberedPerson,
  rememberPerson,
  renamePerson,
  takeCredential,
  takeFarewell,
} from "../api/session";
import { boundedPart } from "../ui/lazy-part";
import { useRootMark } from "../ui/use-root-mark";
import { useWatched } from "../ui/watched";
import style from "./sign-in-gate.module.css";

const SignIn = boundedPart(() => import("./sign-in").then((part) => part.SignIn));
const Invitation = boundedPart(() => import("./sign-in").then((part) => part.Invitation));
const DeviceSignIn = boundedPart(() => import("./sign-in").then((part) => part.DeviceSignIn));
const SignInBar = boundedPart(() => import("./sign-in").then((part) => part.SignInBar));
const ProviderReturn = boundedPart(() =>
  import("./provider-return").then((part) => part.ProviderReturn),
);

type Gate =
  | { at: "knocking" }
  | { at: "outside"; why: string }
  /** Back from the provider of the server, or about to prove by it that it is they. */
  | { at: "returned" }
  | { at: "invited"; key: Credential; invited: InvitationPreview }
  | { at: "device"; code: Credential }
  /** `offline`: no server has said who this is; it is who was here last. */
  | { at: "inside"; person: Person; visit: number; offline?: true };

/** Return whether the address is that of `provider-return.tsx`, with something for it. */
const isReturned = () =>
  location.pathname === `${basePath}/signed-in` && /[?&](state|again)\b/.test(location.search);

async function knock(): Promise<Gate> {
  if (isReturned()) return { at: "returned" };
  const key = takeCredential();
  const before = rememberedPerson();
  try {
    if (key?.kind === "device") return { at: "device", code: key };
    if (key?.kind === "invitation") return await knockInvited(key);
    const person = key === null ? await known(before) : await openSession(key);
    return { at: "inside", person, visit: 0 };
  } catch (error) {
    if (key === null && before !== null && isOutcomeUnknown(error)) {
      return { at: "inside", person: before, visit: 0, offline: true };
    }
    const refused = error instanceof Refusal && error.details.status === 401;
    if (refused && key === null) rememberPerson(null);
    if (refused && isWithdrawn(error)) return { at: "outside", why: WITHDRAWN };
    if (refused && key === null) return { at: "outside", why: takeFarewell() };
    const strange = refused && key?.kind === "token";
    return {
      at: "outside",
      why: strange
        ? "This link belongs to another server, or to an earlier start of this server."
        : errorText(error),
    };
  }
}

const SETTLED = 10_000; // ms after which the first view is there
const PATIENCE = 5_000; // ms until a device shows what it keeps

/**
 * Return who is signed in. If this browser remembers a person, wait for a silent server for
 * `PATIENCE` only.
 */
const known = (before: Person | null) => currentPerson(before === null ? undefined : PATIENCE);

/**
 * Let a person in who has given a name in this browser before; ask others for a name first. A personal
 * link is used only when its person says so, since it works once.
 */
async function knockInvited(key: Credential): Promise<Gate> {
  const invited = await readInvitation(key.text);
  if (invited.name != null) return { at: "invited", key, invited };
  const known = rememberedName() !== "" || (await currentPerson().catch(() => null))?.name;
  if (!known) return { at: "invited", key, invited };
  return { at: "inside", person: await openSession(key), visit: 0 };
}

function isWithdrawn(error: unknown): boolean {
  return error instanceof Refusal && error.details.type === "withdrawn";
}

const WITHDRAWN =
  "Your link was revoked, or an owner ended your access. Ask for another link. Changes that were not sent stay on this device.";

const visitOf = (gate: Gate): number => (gate.at === "inside" ? gate.visit : 0);

/**
 * Returns the open gate. The person stays the same object while nothing about them changes, so that nothing below
 * begins anew.
 */
function inside(gate: Gate, person: Person): Gate & { at: "inside" } {
  const known = gate.at === "inside" ? gate.person : null;
  const same = known?.id === person.id && known.name === person.name && known.role === person.role;
  return { at: "inside", person: same ? known : person, visit: visitOf(gate) + 1 };
}

/** A link that is refused puts nobody out who is inside already. */
const stay = (gate: Gate, next: Gate): Gate =>
  gate.at === "inside" && next.at === "outside" ? gate : next;

interface SessionLooks {
  readonly on: boolean;
  /** The page has no session, or does not know of one: whoever is found is let in. */
  readonly wanting: boolean;
  onFound(person: Person): void;
  putOut(): void;
}

/** Asks now and then who is signed in: another tab of this browser may sign in or out at any time. */
function useLooks({ on, wanting, onFound, putOut }: SessionLooks): void {
  useEffect(() => {
    if (!on) return;
    const look = () =>
      void currentPerson().then(wanting ? onFound : () => {}, (error) => {
        if (isWithdrawn(error)) putOut();
      });
    let wait = wanting ? 3_000 : 30_000;
    let timer: ReturnType<typeof setTimeout>;
    const goOn = () => {
      timer = setTimeout(goOn, wait);
      // Nobody else may come for hours: whoever comes back to this page is let in at once.
      if (wanting) wait = Math.min(2 * wait, 10_000);
      look();
    };
    if (wanting) goOn();
    else timer = setTimeout(goOn, wait);
    window.addEventListener("focus", look);
    return () => {
      clearTimeout(timer);
      window.removeEventListener("focus", look);
    };
  }, [on, wanting, onFound, putOut]);
}

/** Keeps STOP for whoever has a session, also where they open another link or prove that it is they. */
function useStopOf(gate: Gate): void {
  // What is drawn may fail and go; the link stays, so nothing is undone when this does.
  useLayoutEffect(() => {
    if (gate.at === "knocking") return;
    const person = gate.at === "inside" ? gate.person : rememberedPerson();
    if (person === null) pageLink.leave();
    else pageLink.enter(person, visitOf(gate));
  }, [gate]);
  const { at } = gate;
  useEffect(() => {
    if (at === "inside" || at === "knocking" || rememberedPerson() !== null) return;
    let gone = false;
    const onFound = (person: Person) => {
      if (gone) return;
      pageLink.enter(person, 0);
      rememberPerson(person);
    };
    currentPerson().then(onFound, () => {}); // without a session there is nobody to keep it for
    return () => {
      gone = true;
    };
  }, [at]);
}

export function SignInGate({ children }: { children: ReactNode }) {
  const [gate, setGate] = useState<Gate>({ at: "knocking" });
  useEffect(() => {
    let gone = false;
    const enter = () =>
      void knock().then((next) => {
        if (gone) return;
        if (next.at === "inside") sessionEnd.clear();
        setGate((now) => {
          if (next.at !== "inside") return stay(now, next);
          return next.offline && now.at !== "inside" ? next : inside(now, next.person);
        });
      });
    // A fresh link pasted into the same tab changes only the fragment.
    const onHash = () => {
      if (credentialIn(location.hash) !== null) enter();
    };
    enter();
    window.addEventListener("hashchange", onHash);
    return () => {
      gone = true;
      window.removeEventListener("hashchange", onHash);
    };
  }, []);
  const takeName = useCallback(async (name: string) => {
    const person = await renamePerson(name);
    setGate((now) => ({ ...inside(now, { ...person, name }), visit: visitOf(now) }));
  }, []);
  const client = useQueryClient();
  const letIn = useCallback(
    (person: Person) => {
      sessionEnd.clear();
      setGate((now) => inside(now, person));
      void client.invalidateQueries();
    },
    [client],
  );
  const ended = useWatched(sessionEnd);
  const offline = gate.at === "inside" && gate.offline === true;
  const putOut = useCallback(() => {
    rememberPerson(null);
    setGate({ at: "outside", why: WITHDRAWN });
  }, []);
  useLooks({ on: gate.at === "inside", wanting: ended || offline, onFound: letIn, putOut });
  useEffect(() => {
    if (gate.at !== "inside" || gate.offline) return;
    rememberPerson(gate.person);
    // When it is needed, the server may not answer.
    const later = setTimeout(() => void SignInBar.preload(), SETTLED);
    return () => clearTimeout(later);
  }, [gate]);
  useStopOf(gate);
  const hold = useMemo(
    () =>
      gate.at === "inside" ? { person: gate.person, visit: gate.visit, rename: takeName } : null,
    [gate, takeName],
  );
  if (gate.at === "knocking") return <div aria-busy="true" />;
  if (gate.at === "returned") return <ProviderReturn onOpen={letIn} />;
  if (gate.at === "invited") {
    return <Invitation key={gate.key.text} link={gate.key} invited={gate.invited} onOpen={letIn} />;
  }
  if (gate.at === "device") {
    return <DeviceSignIn key={gate.code.text} code={gate.code} onOpen={letIn} />;
  }
  if (hold === null) {
    return <SignIn why={gate.at === "outside" ? gate.why : ""} onOpen={letIn} />;
  }
  return (
    <PersonContext value={hold}>
      {children}
      {offline && <OfflineBar />}
      {ended && <SignInBar onOpen={letIn} />}
    </PersonContext>
  );
}

function OfflineBar() {
  useRootMark("data-offline", true);
  return (
    <p className={style.bar} role="status">
      <IconPlugConnectedX size={18} aria-hidden />
      <span>
        <b>Offline: you see the copy on this device.</b> Robots cannot be started or stopped from
        here now; use the hardware stop. Edits wait on this device until the server answers.
      </span>
    </p>
  );
}
