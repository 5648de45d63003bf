/** The page for somebody who comes by a link: says what it leads to, and asks for a name, once. */
import { Button, Paper, Text, TextInput, Title } from "@mantine/core";
import { useState } from "react";
import { sentence } from "../api/http";
import {
  type Invited,
  type Key,
  openSession,
  type Person,
  ROLE_WORDS,
  rememberName,
} from "../api/session";
import { Mark } from "../ui/top-bar";
import style from "./sign-in.module.css";

interface Props {
  link: Key;
  invited: Invited;
  onOpen: (person: Person) => void;
}

export function Invitation({ link, invited, onOpen }: Props) {
  const [name, setName] = useState("");
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const enter = async () => {
    setBusy(true);
    try {
      const person = await openSession(link, name.trim());
      rememberName(person.name);
      onOpen(person);
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
          {invited.by === "" ? "You are invited" : `${invited.by} invites you`} as {invited.role}
        </Title>
        <Text c="dimmed" mt="xs">
          To TeMoto Action Assistant, where robot tasks are drawn and run. You may{" "}
          {ROLE_WORDS[invited.role]}.
        </Text>
        <form
          onSubmit={(event) => {
            event.preventDefault();
            void enter();
          }}
        >
          <TextInput
            mt="lg"
            label="What should others see you as?"
            value={name}
            maxLength={60}
            autoFocus
            autoComplete="name"
            error={problem || undefined}
            onChange={(event) => {
              setName(event.currentTarget.value);
              setProblem("");
            }}
          />
          <Button
            type="submit"
            variant="filled"
            fullWidth
            mt="md"
            loading={busy}
            disabled={name.trim() === ""}
          >
            Come in
          </Button>
        </form>
      </Paper>
    </main>
  );
}
