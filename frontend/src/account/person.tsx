/** Who is signed in, for every feature below. */
import { createContext, use } from "react";
import type { Person } from "../api/session";

export interface PersonHold {
  person: Person;
  /** How often somebody has signed in since the page was opened: sockets begin anew with each. */
  visit: number;
  rename: (name: string) => Promise<void>;
}

export const PersonContext = createContext<PersonHold | null>(null);

export function usePerson(): PersonHold {
  const hold = use(PersonContext);
  if (hold === null) throw new Error("usePerson needs a signed-in page around it");
  return hold;
}
