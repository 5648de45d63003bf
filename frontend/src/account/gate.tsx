/** Lets the page in only with a session, and knows whose it is. */
import { type ReactNode, useCallback, useEffect, useMemo, useState } from "react";
import { Refusal, sentence } from "../api/http";
import { currentPerson, openSession, type Person, rename, takeToken } from "../api/session";
import { PersonContext } from "./person";
import { SignIn } from "./sign-in";

type Gate = { at: "knocking" } | { at: "outside"; why: string } | { at: "inside"; person: Person };

async function knock(): Promise<Gate> {
  const token = takeToken();
  try {
    const person = token === null ? await currentPerson() : await openSession(token);
    return { at: "inside", person };
  } catch (error) {
    const refused = error instanceof Refusal && error.details.status === 401;
    if (refused && token === null) return { at: "outside", why: "" };
    return {
      at: "outside",
      why: refused ? "The link is of another server, or of an older start." : sentence(error),
    };
  }
}

export function Gate({ children }: { children: ReactNode }) {
  const [gate, setGate] = useState<Gate>({ at: "knocking" });
  useEffect(() => {
    let gone = false;
    const enter = () =>
      void knock().then((next) => {
        if (!gone) setGate(next);
      });
    // A fresh link pasted into the same tab changes only the fragment.
    const onHash = () => {
      if (location.hash.includes("t=")) enter();
    };
    enter();
    window.addEventListener("hashchange", onHash);
    return () => {
      gone = true;
      window.removeEventListener("hashchange", onHash);
    };
  }, []);
  const takeName = useCallback(async (name: string) => {
    const person = await rename(name);
    setGate({ at: "inside", person: { ...person, name } });
  }, []);
  const person = gate.at === "inside" ? gate.person : null;
  const hold = useMemo(() => person && { person, rename: takeName }, [person, takeName]);
  if (gate.at === "knocking") return <div aria-busy="true" />;
  if (hold === null) {
    return (
      <SignIn
        why={gate.at === "outside" ? gate.why : ""}
        onOpen={(who) => setGate({ at: "inside", person: who })}
      />
    );
  }
  return <PersonContext value={hold}>{children}</PersonContext>;
}
