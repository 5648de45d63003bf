/** Asks to sign in again in place: the session has ended, the page and its edits have not. */
import { Button, PasswordInput } from "@mantine/core";
import { openSession, type Person } from "../api/session";
import { pastedCredential } from "./sign-in";
import style from "./sign-in-bar.module.css";
import { useSignInField } from "./use-sign-in-field";

export function SignInBar({ onOpen }: { onOpen: (person: Person) => void }) {
  const entry = useSignInField((pasted) => openSession(pastedCredential(pasted)), onOpen);
  return (
    <form className={style.bar} aria-label="Sign in again" {...entry.form}>
      <p role="status">
        <b>Your session has ended.</b> Edits stay in this page, and STOP is still sent. Paste your
        link to go on.
      </p>
      <PasswordInput
        aria-label="Link or token"
        placeholder="http://…/#t=…"
        autoComplete="off"
        {...entry.field}
      />
      <Button {...entry.button} variant="filled">
        Sign in
      </Button>
    </form>
  );
}
