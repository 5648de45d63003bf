/** Sign-in by the identity provider of the server, where one is set. */
import { Button, Text } from "@mantine/core";
import { useEffect, useState } from "react";
import { errorText } from "../api/http";
import { pageUrl } from "../api/page-url";
import { PROOF_URL, providerOffer, visitProvider } from "../api/provider";
import style from "./sign-in.module.css";

const NONE = { name: null, mine: false } as const;

/** Return the provider; one without a name while it is not known, and where none is set. */
function useProvider() {
  const [offer, setOffer] = useState<Awaited<ReturnType<typeof providerOffer>>>(NONE);
  useEffect(() => {
    let gone = false;
    providerOffer().then(
      (found) => !gone && setOffer(found),
      () => {}, // the other ways to sign in say it when the server does not answer
    );
    return () => {
      gone = true;
    };
  }, []);
  return offer;
}

/** The button that leads to the provider; nothing where none is set. `why`: what came of the last visit. */
export function ProviderButton({ why, again = false }: { why: string; again?: boolean }) {
  const offer = useProvider();
  const { name } = offer;
  const isKnown = offer !== NONE;
  const [problem, setProblem] = useState(why);
  const [busy, setBusy] = useState(false);
  useEffect(() => {
    // Back from the provider by the browser's own button, the page is as it was left.
    const onShow = () => setBusy(false);
    window.addEventListener("pageshow", onShow);
    return () => window.removeEventListener("pageshow", onShow);
  }, []);
  const go = () => {
    setBusy(true);
    setProblem("");
    visitProvider(again).catch((error) => {
      setProblem(errorText(error));
      setBusy(false);
    });
  };
  return (
    <>
      {problem !== "" && (
        <Text className="ink-error" mt="md" role="alert">
          {problem}
        </Text>
      )}
      {isKnown && name == null && again && (
        <Text mt="md">
          No provider is set here. Close this tab, and confirm on another device or with a passkey.
        </Text>
      )}
      {name != null && (
        <>
          <Button variant="filled" fullWidth mt="md" loading={busy} onClick={go}>
            <span className={style.provider}>
              {again ? "Confirm with" : "Sign in with"} <bdi>{name}</bdi>
            </span>
          </Button>
          {!again && (
            <Text size="xs" c="dimmed" mt="xs">
              Signing out here leaves you signed in there.
            </Text>
          )}
        </>
      )}
    </>
  );
}

/** A link to the page in another tab, where a person signs in by the provider while edits stay in this
 * one. */
export function ProviderLink() {
  const { name } = useProvider();
  if (name == null) return null;
  return (
    <>
      {" "}
      Or{" "}
      <a href={`${pageUrl()}/`} target="_blank" rel="noopener">
        sign in with <bdi>{name}</bdi> in a new tab
      </a>
      .
    </>
  );
}

/** A link to the page in another tab on which a person who came by the provider proves by it that it is
 * they; nothing for others. */
export function ProofLink() {
  const { name, mine } = useProvider();
  if (name == null || !mine) return null;
  return (
    <Text size="sm">
      Or{" "}
      <a href={PROOF_URL} target="_blank" rel="noopener">
        sign in with <bdi>{name}</bdi> again
      </a>
      , in a new tab, and come back to this one.
    </Text>
  );
}
