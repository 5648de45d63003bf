/** Who is signed in, for every feature. */
import { createContext, use } from "react";
import { may, type Permission, type Person } from "./session";

export interface SignedIn {
  person: Person;
  /** How often somebody has signed in since the page was opened: sockets begin anew with each. */
  visit: number;
  rename: (name: string) => Promise<void>;
}

export const PersonContext = createContext<SignedIn | null>(null);

export function usePerson(): SignedIn {
  const hold = use(PersonContext);
  if (hold === null) throw new Error("usePerson needs a signed-in page around it");
  return hold;
}

/** Whether the one who is signed in may do this. */
export function useMay(permission: Permission): boolean {
  return may(usePerson().person.role, permission);
}
