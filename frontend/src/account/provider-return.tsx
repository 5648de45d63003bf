/** The page to which the identity provider of the server sends the browser back. */
import { Paper, Text, Title } from "@mantine/core";
import { useEffect, useState } from "react";
import { errorText } from "../api/http";
import { handInProviderAnswer, takeProviderReturn } from "../api/provider";
import { currentPerson, type Person } from "../api/session";
import { Logo } from "../ui/top-bar";
import { ProviderButton } from "./provider-sign-in";
import { SignIn } from "./sign-in";
import style from "./sign-in.module.css";

type Visit =
  | { at: "waiting" }
  /** The provider signed nobody in. */
  | { at: "outside"; why: string }
  /** A person who is signed in proves that it is they, or has done so. */
  | { at: "proving"; done: boolean; why: string };

/** Takes what the provider sent the browser back with; returns how it ended. */
function useVisit(onOpen: (person: Person) => void): Visit {
  const [visit, setVisit] = useState<Visit>({ at: "waiting" });
  useEffect(() => {
    const found = takeProviderReturn();
    if (found === null) return;
    if (found.kind === "again") {
      setVisit({ at: "proving", done: false, why: "" });
      return;
    }
    const onRefused = async (error: unknown) => {
      const why = errorText(error);
      // Whoever is signed in wanted to prove that it is they.
      const isInside = await currentPerson().then(
        () => true,
        () => false,
      );
      setVisit(isInside ? { at: "proving", done: false, why } : { at: "outside", why });
    };
    handInProviderAnswer(found.answer).then((person) => {
      if (person === null) setVisit({ at: "proving", done: true, why: "" });
      else onOpen(person);
    }, onRefused);
  }, [onOpen]);
  return visit;
}

/** The page to which the provider sends the browser back, and on which a person who is signed in proves
 * by the provider that it is they. */
export function ProviderReturn({ onOpen }: { onOpen: (person: Person) => void }) {
  const visit = useVisit(onOpen);
  if (visit.at === "outside") return <SignIn why="" providerWhy={visit.why} onOpen={onOpen} />;
  const done = visit.at === "proving" && visit.done;
  return (
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Logo />
        {visit.at === "waiting" ? (
          <Text mt="md" role="status">
            Signing in …
          </Text>
        ) : (
          <>
            <Title order={1} size="h3" mt="md">
              {done ? "It is confirmed that it is you" : "Confirm that it is you"}
            </Title>
            <Text c="dimmed" mt="xs">
              {done
                ? "Close this tab, and go on in the one before."
                : "You are asked for your password there, also if you are signed in."}
            </Text>
            {!done && <ProviderButton why={visit.why} again />}
          </>
        )}
      </Paper>
    </main>
  );
}
