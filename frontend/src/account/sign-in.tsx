/** The page for somebody whom the server does not know: says how to get in. */
import { Button, Paper, PasswordInput, Text, Title } from "@mantine/core";
import { type Credential, credentialIn, openSession, type Person } from "../api/session";
import { Logo } from "../ui/top-bar";
import style from "./sign-in.module.css";
import { useSignInField } from "./use-sign-in-field";

interface Props {
  /** Why nobody is signed in, when a link was tried. */
  why: string;
  onOpen: (person: Person) => void;
}

/** What has no fragment is taken for the token itself. */
export function pastedCredential(pasted: string): Credential {
  return credentialIn(pasted) ?? { kind: "token", text: pasted.trim() };
}

export function SignIn({ why, onOpen }: Props) {
  const entry = useSignInField((pasted) => openSession(pastedCredential(pasted)), onOpen, why);
  return (
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Logo />
        <Title order={1} size="h3" mt="md">
          TeMoto Action Assistant
        </Title>
        <Text c="dimmed" mt="xs">
          Open the link that the server printed when it started, or the one that you were given. It
          signs this browser in. You can paste it here as well.
        </Text>
        <form {...entry.form}>
          <PasswordInput
            mt="lg"
            size="sm"
            label="Link or token"
            placeholder="http://…/#t=…"
            autoFocus
            autoComplete="off"
            {...entry.field}
          />
          <Button {...entry.button} variant="filled" fullWidth mt="md">
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
