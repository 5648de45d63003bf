/** Asks to sign in again in place: the session has ended, the page and its edits have not. */
import { Button, PasswordInput } from "@mantine/core";
import { useState } from "react";
import { sentence } from "../api/http";
import { openSession, type Person } from "../api/session";
import { pastedKey } from "./sign-in";
import style from "./sign-in-bar.module.css";

export function SignInBar({ onOpen }: { onOpen: (person: Person) => void }) {
  const [pasted, setPasted] = useState("");
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const submit = async () => {
    setBusy(true);
    try {
      onOpen(await openSession(pastedKey(pasted)));
    } catch (error) {
      setProblem(sentence(error));
      setBusy(false);
    }
  };
  return (
    <form
      className={style.bar}
      aria-label="Sign in again"
      onSubmit={(event) => {
        event.preventDefault();
        void submit();
      }}
    >
      <p role="status">
        <b>Your session has ended.</b> Edits stay in this page, and STOP is still sent. Paste your
        link to go on.
      </p>
      <PasswordInput
        aria-label="Link or token"
        placeholder="http://…/#t=…"
        autoComplete="off"
        value={pasted}
        error={problem || undefined}
        onChange={(event) => {
          setPasted(event.currentTarget.value);
          setProblem("");
        }}
      />
      <Button type="submit" variant="filled" loading={busy} disabled={pasted.trim() === ""}>
        Sign in
      </Button>
    </form>
  );
}
