/** Asks for a name, once, in the flow of the first page: it covers nothing. */
import { Button, CloseButton, TextInput } from "@mantine/core";
import { useState } from "react";
import { errorText } from "../api/http";
import { usePerson } from "../api/people";
import { rememberedName } from "../api/session";
import style from "./name-prompt.module.css";

const SUGGESTION = "Operator";
/** "Not now" holds until the page is opened anew. */
let putOff = false;

export function NamePrompt() {
  const { person, rename } = usePerson();
  const [open, setOpen] = useState(() => !putOff && rememberedName() === "" && person.name === "");
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
        className={style.name ?? ""}
        label="What should others see you as?"
        value={name}
        maxLength={60}
        error={problem || undefined}
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Button type="submit" variant="filled" flex="none" disabled={name.trim() === ""}>
        Save
      </Button>
      <CloseButton
        className={style.later ?? ""}
        aria-label="Not now"
        onClick={() => {
          putOff = true;
          setOpen(false);
        }}
      />
    </form>
  );
}
