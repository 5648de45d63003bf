/** The page for somebody whom the server does not know: says how to get in. */
import { Button, Paper, PasswordInput, Text, TextInput, Title } from "@mantine/core";
import { type ChangeEvent, type FormEvent, useState } from "react";
import { errorText } from "../api/http";
import {
  type Credential,
  credentialIn,
  type InvitationPreview,
  openSession,
  type Person,
  ROLE_WORDS,
  rememberName,
} from "../api/session";
import { Logo } from "../ui/top-bar";
import { isolated } from "../words/isolated";
import style from "./sign-in.module.css";

interface Props {
  /** The reason why nobody is signed in, if a link was tried. */
  why: string;
  onOpen: (person: Person) => void;
}

/** Return the credential in a pasted text; a text without a fragment is taken for the token. */
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
          Is this your server, and you lost the link? Paste its token instead: the content of the
          file <code>token</code> in the server’s data folder.
        </Text>
      </Paper>
    </main>
  );
}

interface InvitationProps {
  link: Credential;
  invited: InvitationPreview;
  onOpen: (person: Person) => void;
}

export function Invitation({ link, invited, onOpen }: InvitationProps) {
  const entry = useSignInField(async (name) => {
    const person = await openSession(link, name);
    rememberName(person.name);
    return person;
  }, onOpen);
  return (
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Logo />
        <Title order={1} size="h3" mt="md">
          {invited.by === "" ? "You are invited" : `${isolated(invited.by)} invites you`} as{" "}
          {invited.role}
        </Title>
        <Text c="dimmed" mt="xs">
          To TeMoto Action Assistant, where robot tasks are drawn and run. You may{" "}
          {ROLE_WORDS[invited.role]}.
        </Text>
        <form {...entry.form}>
          <TextInput
            mt="lg"
            label="What should others see you as?"
            maxLength={60}
            autoFocus
            autoComplete="name"
            {...entry.field}
          />
          <Button {...entry.button} variant="filled" fullWidth mt="md">
            Come in
          </Button>
        </form>
      </Paper>
    </main>
  );
}

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

/** `enter` asks the server with what was typed; what it throws is shown at the field. */
export function useSignInField(
  enter: (typed: string) => Promise<Person>,
  onOpen: (person: Person) => void,
  why = "",
) {
  const [typed, setTyped] = useState("");
  const [problem, setProblem] = useState(why);
  const [busy, setBusy] = useState(false);
  const submit = async () => {
    setBusy(true);
    try {
      onOpen(await enter(typed.trim()));
    } catch (error) {
      setProblem(errorText(error));
      setBusy(false);
    }
  };
  return {
    form: {
      onSubmit: (event: FormEvent) => {
        event.preventDefault();
        void submit();
      },
    },
    field: {
      value: typed,
      error: problem || undefined,
      onChange: (event: ChangeEvent<HTMLInputElement>) => {
        setTyped(event.currentTarget.value);
        setProblem("");
      },
    },
    button: { type: "submit", loading: busy, disabled: typed.trim() === "" },
  } as const;
}
