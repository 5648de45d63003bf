/** The page for somebody whom the server does not know: says how to get in. */
import { Button, Paper, PasswordInput, Text, Title } from "@mantine/core";
import { useState } from "react";
import { Refusal, sentence } from "../api/http";
import { openSession, type Person } from "../api/session";
import { Mark } from "../ui/top-bar";
import style from "./sign-in.module.css";

interface Props {
  /** Why nobody is signed in, when a link was tried. */
  why: string;
  onOpen: (person: Person) => void;
}

/** A pasted link counts as its token. */
export function tokenIn(pasted: string): string {
  const found = /[#&]t=([^&\s]+)/.exec(pasted);
  return found?.[1] ? decodeURIComponent(found[1]) : pasted.trim();
}

export function SignIn({ why, onOpen }: Props) {
  const [pasted, setPasted] = useState("");
  const [problem, setProblem] = useState(why);
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
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Mark />
        <Title order={1} size="h3" mt="md">
          TeMoto Action Assistant
        </Title>
        <Text c="dimmed" mt="xs">
          Open the link that the server printed when it started. It ends in <code>#t=…</code> and
          signs this browser in. You can paste it here as well.
        </Text>
        <form
          onSubmit={(event) => {
            event.preventDefault();
            void submit();
          }}
        >
          <PasswordInput
            mt="lg"
            size="sm"
            label="Link or token"
            placeholder="http://…/#t=…"
            value={pasted}
            autoFocus
            autoComplete="off"
            error={problem || undefined}
            onChange={(event) => {
              setPasted(event.currentTarget.value);
              setProblem("");
            }}
          />
          <Button
            type="submit"
            variant="filled"
            fullWidth
            mt="md"
            loading={busy}
            disabled={pasted.trim() === ""}
          >
            Sign in
          </Button>
        </form>
        <Text size="xs" c="dimmed" mt="lg">
          Lost it? It is the content of the file <code>token</code> in the server’s data folder.
        </Text>
      </Paper>
    </main>
  );
}
