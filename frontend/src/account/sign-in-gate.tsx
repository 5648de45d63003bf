/** Lets the page in only with a session, and knows whose it is. */
import { useQueryClient } from "@tanstack/react-query";
import {
  type ReactNode,
  useCallback,
  useEffect,
  useMemo,
  useState,
  useSyncExternalStore,
} from "react";
import { errorText, Refusal } from "../api/http";
import {
  type Credential,
  credentialIn,
  currentPerson,
  type InvitationPreview,
  openSession,
  type Person,
  readInvitation,
  rememberedName,
  renamePerson,
  takeCredential,
  takeFarewell,
} from "../api/session";
import { sessionEnd } from "../api/session-end";
import { PersonContext } from "../api/use-person";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";

const SignIn = lazyPart(() => import("./sign-in").then((part) => part.SignIn));
const Invitation = lazyPart(() => import("./invitation").then((part) => part.Invitation));
const SignInBar = lazyPart(() => import("./sign-in-bar").then((part) => part.SignInBar));

type Gate =
  | { at: "knocking" }
  | { at: "outside"; why: string }
  | { at: "invited"; key: Credential; invited: InvitationPreview }
  | { at: "inside"; person: Person; visit: number };

async function knock(): Promise<Gate> {
  const key = takeCredential();
  try {
    if (key?.kind === "invitation") return await knockInvited(key);
    const person = key === null ? await currentPerson() : await openSession(key);
    return { at: "inside", person, visit: 0 };
  } catch (error) {
    const refused = error instanceof Refusal && error.details.status === 401;
    if (refused && isWithdrawn(error)) return { at: "outside", why: WITHDRAWN };
    if (refused && key === null) return { at: "outside", why: takeFarewell() };
    const strange = refused && key?.kind === "token";
    return {
      at: "outside",
      why: strange ? "The link is of another server, or of an older start." : errorText(error),
    };
  }
}

/** Who has given a name in this browser before goes straight in; else that is asked first. */
async function knockInvited(key: Credential): Promise<Gate> {
  const invited = await readInvitation(key.text);
  const known = rememberedName() !== "" || (await currentPerson().catch(() => null))?.name;
  if (!known) return { at: "invited", key, invited };
  return { at: "inside", person: await openSession(key), visit: 0 };
}

function isWithdrawn(error: unknown): boolean {
  return error instanceof Refusal && error.details.type === "withdrawn";
}

const WITHDRAWN =
  "Your link was revoked. Ask for another one. Changes that were not sent stay on this device.";

const visitOf = (gate: Gate): number => (gate.at === "inside" ? gate.visit : 0);

/** Whoever is inside stays the same object while they are the same: nothing below begins anew. */
function inside(gate: Gate, person: Person): Gate & { at: "inside" } {
  const known = gate.at === "inside" ? gate.person : null;
  const same = known?.id === person.id && known.name === person.name && known.role === person.role;
  return { at: "inside", person: same ? known : person, visit: visitOf(gate) + 1 };
}

/** A link that is refused puts nobody out who is inside already. */
const stay = (gate: Gate, next: Gate): Gate =>
  gate.at === "inside" && next.at === "outside" ? gate : next;

export function SignInGate({ children }: { children: ReactNode }) {
  const [gate, setGate] = useState<Gate>({ at: "knocking" });
  useEffect(() => {
    let gone = false;
    const enter = () =>
      void knock().then((next) => {
        if (gone) return;
        if (next.at === "inside") sessionEnd.clear();
        setGate((now) => (next.at === "inside" ? inside(now, next.person) : stay(now, next)));
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
  const ended = useSyncExternalStore(sessionEnd.subscribe, sessionEnd.now);
  useEffect(() => {
    if (gate.at !== "inside") return;
    // Another tab of this browser may sign in or out at any time.
    const look = () =>
      void currentPerson().then(ended ? letIn : () => {}, (error) => {
        if (isWithdrawn(error)) setGate({ at: "outside", why: WITHDRAWN });
      });
    let wait = ended ? 3_000 : 30_000;
    let timer: ReturnType<typeof setTimeout>;
    const goOn = () => {
      timer = setTimeout(goOn, wait);
      // Nobody else may come for hours: whoever comes back to this page is let in at once.
      if (ended) wait = Math.min(2 * wait, 10_000);
      look();
    };
    if (ended) goOn();
    else timer = setTimeout(goOn, wait);
    window.addEventListener("focus", look);
    return () => {
      clearTimeout(timer);
      window.removeEventListener("focus", look);
    };
  }, [gate.at, ended, letIn]);
  const hold = useMemo(
    () =>
      gate.at === "inside" ? { person: gate.person, visit: gate.visit, rename: takeName } : null,
    [gate, takeName],
  );
  if (gate.at === "knocking") return <div aria-busy="true" />;
  if (gate.at === "invited") {
    return (
      <PartBoundary>
        <Invitation key={gate.key.text} link={gate.key} invited={gate.invited} onOpen={letIn} />
      </PartBoundary>
    );
  }
  if (hold === null) {
    return (
      <PartBoundary>
        <SignIn why={gate.at === "outside" ? gate.why : ""} onOpen={letIn} />
      </PartBoundary>
    );
  }
  return (
    <PersonContext value={hold}>
      {children}
      {ended && (
        <PartBoundary>
          <SignInBar onOpen={letIn} />
        </PartBoundary>
      )}
    </PersonContext>
  );
}
