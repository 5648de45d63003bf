/** In which colour people are shown: the server gives each one that nobody else has who is here. */
import { useQuery } from "@tanstack/react-query";
import { createContext, use, useCallback, useEffect } from "react";
import { fetchJson } from "./http";
import type { EditorApi } from "./schema/editor";
import { may, type Permission, type Person } from "./session";

type KnownPerson = EditorApi["Participant"];

/** Of who has not been here for long: no colour that somebody could have. */
export const NOBODYS_COLOR = "#757575";

/** `color` where it is one, since it comes over the wire and goes into styles. */
export function checkedColor(color: string): string {
  return /^#[0-9a-f]{6}$/i.test(color) ? color : NOBODYS_COLOR;
}

export interface Colored {
  readonly id: string;
  readonly color: string;
}

/**
 * What colour a person has, by id. Those who are here come first: what the server said of others a
 * while ago may meanwhile be the colour of somebody who came.
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
    queryFn: ({ signal }) => fetchJson<KnownPerson[]>("/api/people", { signal }),
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

interface Named {
  readonly id: string;
  readonly name: string;
}

/** What somebody is called now: what was stored of them, a run for one, has the name of then beside their id. */
export function currentName(
  author: Named | null | undefined,
  me: Named,
  known: readonly Named[],
): string {
  if (!author) return "somebody";
  const now = author.id === me.id ? me : known.find(({ id }) => id === author.id);
  return now?.name || author.name || "somebody";
}

/** What the author of a run is called now. */
export function useCurrentName(author: Named | null | undefined): string {
  const { person } = usePerson();
  return currentName(author, person, useKnownPeople(author ? [author.id] : NO_IDS));
}

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
