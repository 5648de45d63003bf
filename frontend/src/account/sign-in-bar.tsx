/** Asks to sign in again in place: the session has ended, the page and its edits have not. */
import { Button, PasswordInput } from "@mantine/core";
import { useState } from "react";
import { Refusal, sentence } from "../api/http";
import { openSession, type Person } from "../api/session";
import { tokenIn } from "./sign-in";
import style from "./sign-in-bar.module.css";

export function SignInBar({ onOpen }: { onOpen: (person: Person) => void }) {
  const [pasted, setPasted] = useState("");
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const submit = async () => {
    setBusy(true);
    try {
      onOpen(await openSession(tokenIn(pasted)));
    } catch (error) {
      const wrong = error instanceof Refusal && error.details.status === 401;
      setProblem(wrong ? "This is not the token of this server." : sentence(error));
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
        <b>Your session has ended.</b> Edits stay in this page, and STOP is still sent. Paste the
        link that the server printed to go on.
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
