/** The colours of people: the server assigns one that nobody else here has. */
import { useQuery } from "@tanstack/react-query";
import { createContext, use, useCallback, useEffect } from "react";
import { afterFirstView } from "../clock/first-view";
import { isolated } from "../words/isolated";
import { editor } from "./client";
import type { EditorApi } from "./schema/editor";
import { may, type Permission, type Person } from "./session";

type KnownPerson = EditorApi["Participant"];

/** Color of people who have not been here for long: no other person can have it. */
export const NOBODYS_COLOR = "#757575";

/** Returns a color that is safe in styles: `color` itself, or that of nobody for any other text. */
export function checkedColor(color: string): string {
  return /^#[0-9a-f]{6}$/i.test(color) ? color : NOBODYS_COLOR;
}

export interface Colored {
  readonly id: string;
  readonly color: string;
}

/**
 * Return the colors of people by id. People who are here come first: an older answer of the server
 * may give others a color that has been taken since.
 */
export function colorsOf(
  here: readonly Colored[],
  known: readonly Colored[],
): (id: string) => string {
  const colors = new Map(here.map(({ id, color }) => [id, checkedColor(color)]));
  const taken = new Set(colors.values());
  for (const { id, color } of known) {
    if (!colors.has(id) && !taken.has(color)) colors.set(id, checkedColor(color));
  }
  return (id) => colors.get(id) ?? NOBODYS_COLOR;
}

const NOBODY: readonly KnownPerson[] = [];
const NO_IDS: readonly string[] = [];

/** Everyone who acted here, read again when one of `ids` is not among them. */
export function useKnownPeople(ids: readonly string[]): readonly KnownPerson[] {
  const { data = NOBODY, refetch } = useQuery({
    queryKey: ["people"],
    queryFn: ({ signal }) =>
      afterFirstView(signal).then(() => editor.get("/api/people", { signal })),
    staleTime: 60_000,
  });
  const unknown = ids.filter((id) => !data.some((person) => person.id === id)).join(" ");
  const loaded = data !== NOBODY;
  useEffect(() => {
    if (loaded && unknown !== "") void refetch();
  }, [loaded, unknown, refetch]);
  return data;
}

/** The colour of each person, where no room tells who is here. */
export function useKnownColors(ids: readonly string[]): (id: string) => string {
  const known = useKnownPeople(ids);
  return useCallback((id: string) => colorsOf([], known)(id), [known]);
}

/** The name of a person whose name is not known. */
export const NAMELESS = "somebody";

interface Named {
  readonly id: string;
  readonly name: string;
  /** The name of the token by which a program acted for the person. */
  readonly program?: string;
}

/** Return the name of somebody who acted, with that of the program that did it for them. */
export function actorWords({ program }: Pick<Named, "program">, name: string): string {
  return program ? `${isolated(name)} by program ${isolated(program)}` : name;
}

/**
 * Return the present name of a person: stored records, such as runs, have the name of their time
 * beside the id.
 */
export function currentName(
  author: Named | null | undefined,
  me: Named,
  known: readonly Named[],
): string {
  if (!author) return NAMELESS;
  const now = author.id === me.id ? me : known.find(({ id }) => id === author.id);
  return now?.name || author.name || NAMELESS;
}

/** Return the present name of the author of a run, with the program that acted for them. */
export function useCurrentName(author: Named | null | undefined): string {
  const { person } = usePerson();
  const name = currentName(author, person, useKnownPeople(author ? [author.id] : NO_IDS));
  return author ? actorWords(author, name) : name;
}

export interface SignedIn {
  person: Person;
  /** Number of sign-ins since the page was opened: sockets reconnect with each. */
  visit: number;
  rename: (name: string) => Promise<void>;
}

export const PersonContext = createContext<SignedIn | null>(null);

export function usePerson(): SignedIn {
  const hold = use(PersonContext);
  if (hold === null) throw new Error("usePerson needs a signed-in page around it");
  return hold;
}

/** Return whether the signed-in person may do this. */
export function useMay(permission: Permission): boolean {
  return may(usePerson().person.role, permission);
}
