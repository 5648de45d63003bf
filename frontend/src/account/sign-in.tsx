/** The page for somebody whom the server does not know: says how to get in. */
import { Button, Paper, PasswordInput, Text, Title } from "@mantine/core";
import { useState } from "react";
import { sentence } from "../api/http";
import { type Key, keyIn, openSession, type Person } from "../api/session";
import { Mark } from "../ui/top-bar";
import style from "./sign-in.module.css";

interface Props {
  /** Why nobody is signed in, when a link was tried. */
  why: string;
  onOpen: (person: Person) => void;
}

/** What has no fragment is taken for the token itself. */
export function pastedKey(pasted: string): Key {
  return keyIn(pasted) ?? { kind: "token", text: pasted.trim() };
}

export function SignIn({ why, onOpen }: Props) {
  const [pasted, setPasted] = useState("");
  const [problem, setProblem] = useState(why);
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
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Mark />
        <Title order={1} size="h3" mt="md">
          TeMoto Action Assistant
        </Title>
        <Text c="dimmed" mt="xs">
          Open the link that the server printed when it started, or the one that you were given. It
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
          It is your server and you lost the link? Its token is the content of the file{" "}
          <code>token</code> in its data folder.
        </Text>
      </Paper>
    </main>
  );
}
