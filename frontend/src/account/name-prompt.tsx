/** Asks for a name, once, where it covers nothing. */
import { Button, CloseButton, TextInput } from "@mantine/core";
import { useState } from "react";
import { errorText } from "../api/http";
import { rememberedName } from "../api/session";
import { usePerson } from "../api/use-person";
import style from "./name-prompt.module.css";

const SUGGESTION = "Operator";

export function NamePrompt() {
  const { person, rename } = usePerson();
  const [open, setOpen] = useState(() => rememberedName() === "" && person.name === "");
  const [name, setName] = useState(person.name || SUGGESTION);
  const [problem, setProblem] = useState("");
  if (!open) return null;
  const save = async () => {
    try {
      await rename(name.trim());
      setOpen(false);
    } catch (error) {
      setProblem(errorText(error));
    }
  };
  return (
    <form
      className={style.ask}
      aria-label="Your name"
      onSubmit={(event) => {
        event.preventDefault();
        void save();
      }}
    >
      <TextInput
        label="What should others see you as?"
        value={name}
        maxLength={60}
        error={problem || undefined}
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Button type="submit" variant="filled" disabled={name.trim() === ""}>
        Save
      </Button>
      <CloseButton aria-label="Not now" onClick={() => setOpen(false)} />
    </form>
  );
}
