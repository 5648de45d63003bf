/** The page for somebody who comes by a link: says what it leads to, and asks for a name, once. */
import { Button, Paper, Text, TextInput, Title } from "@mantine/core";
import {
  type Credential,
  type InvitationPreview,
  openSession,
  type Person,
  ROLE_WORDS,
  rememberName,
} from "../api/session";
import { Logo } from "../ui/top-bar";
import { isolated } from "../words/isolated";
import style from "./sign-in.module.css";
import { useSignInField } from "./use-sign-in-field";

interface Props {
  link: Credential;
  invited: InvitationPreview;
  onOpen: (person: Person) => void;
}

export function Invitation({ link, invited, onOpen }: Props) {
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
