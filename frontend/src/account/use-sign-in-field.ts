/** One field by which somebody comes in: what is typed, why it was refused, whether it is on its way. */
import type { ChangeEvent, FormEvent } from "react";
import { useState } from "react";
import { errorText } from "../api/http";
import type { Person } from "../api/session";

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
