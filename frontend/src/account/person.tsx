/** Who is signed in, for every feature below. */
import { createContext, use } from "react";
import type { Person } from "../api/session";

export interface PersonHold {
  person: Person;
  rename: (name: string) => Promise<void>;
}

export const PersonContext = createContext<PersonHold | null>(null);

export function usePerson(): PersonHold {
  const hold = use(PersonContext);
  if (hold === null) throw new Error("usePerson needs a signed-in page around it");
  return hold;
}
