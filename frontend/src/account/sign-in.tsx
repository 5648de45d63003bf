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
  signInByCode,
} from "../api/session";
import { Logo } from "../ui/top-bar";
import { isolated } from "../words/isolated";
import { ProviderButton, ProviderLink } from "./provider-sign-in";
import style from "./sign-in.module.css";

interface Props {
  /** The reason why nobody is signed in, if a link was tried. */
  why: string;
  /** The reason why the provider of the server signed nobody in. */
  providerWhy?: string;
  onOpen: (person: Person) => void;
}

/**
 * Return the credential in a pasted text. A text without a fragment is a code of 8 characters, or else
 * the token.
 */
export function pastedCredential(pasted: string): Credential {
  const text = pasted.trim();
  const kind = /^[A-Za-z0-9]{4}[- ]?[A-Za-z0-9]{4}$/.test(text) ? "device" : "token";
  return credentialIn(pasted) ?? { kind, text };
}

/** Return a sign-in by a credential, and what to show while another device has to confirm it. */
function useEnter() {
  const [number, setNumber] = useState("");
  const enter = (key: Credential) => {
    if (key.kind !== "device") return openSession(key);
    return signInByCode(key.text, (waiting) => setNumber(waiting.number)).finally(() =>
      setNumber(""),
    );
  };
  const waiting = number !== "" && (
    <Text mt="sm" role="status">
      Confirm this device on the other one. Both show <b>{number}</b>.
    </Text>
  );
  return { enter, waiting };
}

export function SignIn({ why, providerWhy = "", onOpen }: Props) {
  const { enter, waiting } = useEnter();
  const entry = useSignInField((pasted) => enter(pastedCredential(pasted)), onOpen, why);
  return (
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Logo />
        <Title order={1} size="h3" mt="md">
          TeMoto Action Assistant
        </Title>
        <Text c="dimmed" mt="xs">
          Open the link that the server printed when it started, or the one that you were given. It
          signs this browser in. You can paste it here as well, or type the code that another device
          of yours shows.
        </Text>
        <ProviderButton why={providerWhy} />
        <form {...entry.form}>
          <PasswordInput
            mt="lg"
            size="sm"
            label="Link, code or token"
            placeholder="http://…/#t=…"
            autoFocus
            autoComplete="off"
            {...entry.field}
          />
          <Button {...entry.button} variant="filled" fullWidth mt="md">
            Sign in
          </Button>
          {waiting}
        </form>
        <Text size="xs" c="dimmed" mt="lg">
          Is this your server, and you lost the link? Paste its token instead: the content of the
          file <code>token</code> in the server’s data folder.
        </Text>
      </Paper>
    </main>
  );
}

/** The page behind the QR code that another device of the person shows. */
export function DeviceSignIn({ code, onOpen }: { code: Credential; onOpen: Props["onOpen"] }) {
  const { enter, waiting } = useEnter();
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const go = () => {
    setBusy(true);
    enter(code).then(onOpen, (error) => {
      setProblem(errorText(error));
      setBusy(false);
    });
  };
  return (
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Logo />
        <Title order={1} size="h3" mt="md">
          Sign in on this device
        </Title>
        <Text c="dimmed" mt="xs">
          Then confirm it on the device that shows the code.
        </Text>
        {problem !== "" && (
          <Text className="ink-error" mt="sm" role="alert">
            {problem}
          </Text>
        )}
        <Button variant="filled" fullWidth mt="md" loading={busy} onClick={go}>
          Sign in
        </Button>
        {waiting}
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
  const { name } = invited;
  const entry = useSignInField(
    async (typed) => {
      const person = await openSession(link, name == null ? typed : "");
      if (name == null) rememberName(person.name);
      return person;
    },
    onOpen,
    "",
    name ?? "",
  );
  const guest = name == null ? "you" : isolated(name);
  return (
    <main className={style.page}>
      <Paper className={style.card} withBorder radius="lg">
        <Logo />
        <Title order={1} size="h3" mt="md">
          {invited.by === ""
            ? `${name == null ? "You are" : `${guest} is`} invited`
            : `${isolated(invited.by)} invites ${guest}`}{" "}
          as {invited.role}
        </Title>
        <Text c="dimmed" mt="xs">
          To TeMoto Action Assistant, where robot tasks are drawn and run. You may{" "}
          {ROLE_WORDS[invited.role]}.
        </Text>
        <form {...entry.form}>
          {name == null ? (
            <TextInput
              mt="lg"
              label="What should others see you as?"
              maxLength={60}
              autoFocus
              autoComplete="name"
              {...entry.field}
            />
          ) : (
            <Text mt="md" className={entry.field.error ? "ink-error" : ""}>
              {entry.field.error ??
                "This link works once, in one browser. Open it where you work; add other devices from there."}
            </Text>
          )}
          <Button {...entry.button} variant="filled" fullWidth mt="md">
            {name == null ? "Come in" : `Come in as ${isolated(name)}`}
          </Button>
        </form>
      </Paper>
    </main>
  );
}

export function SignInBar({ onOpen }: { onOpen: (person: Person) => void }) {
  const { enter, waiting } = useEnter();
  const entry = useSignInField((pasted) => enter(pastedCredential(pasted)), onOpen);
  return (
    <form className={style.bar} aria-label="Sign in again" {...entry.form}>
      <p role="status">
        <b>Your session has ended.</b> Edits stay in this page, and STOP is still sent. Paste your
        link to go on.
        <ProviderLink />
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
      {waiting}
    </form>
  );
}

/**
 * Keeps the state of a field by which people sign in. `enter` asks the server with what was typed; what it throws is
 * shown at the field.
 */
export function useSignInField(
  enter: (typed: string) => Promise<Person>,
  onOpen: (person: Person) => void,
  why = "",
  filled = "",
) {
  const [typed, setTyped] = useState(filled);
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
