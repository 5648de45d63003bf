/** Mentions in the text of a comment: whom `@` suggests, and who is named in the end. Pure. */

export interface MentionablePerson {
  readonly id: string;
  readonly name: string;
}

/** The part of a text, up to the caret, that asks for a person: it begins with `@` after a blank. */
export interface MentionQuery {
  /** The position of the `@`. */
  readonly at: number;
  readonly search: string;
}

const QUERY = /(?:^|[\s([{"'])@([^@\n]{0,40})$/u;
const PART_OF_A_NAME = /[\p{L}\p{N}_-]/u;
/** The server takes so many at most. */
const MOST = 20;
const SHOWN = 8;

/** Return the query before the caret; null if there is none. */
export function queryAt(text: string, caret: number): MentionQuery | null {
  const found = QUERY.exec(text.slice(0, caret));
  if (found === null) return null;
  const search = found[1] ?? "";
  if (/\s\s|\s$/.test(search)) return null;
  return { at: caret - search.length - 1, search };
}

/** Return the persons who fit a query: those whose name begins with it come first. */
export function suggestions(
  people: readonly MentionablePerson[],
  search: string,
): MentionablePerson[] {
  const wanted = search.toLocaleLowerCase();
  const ranked = people
    .map((person) => ({ person, name: person.name.toLocaleLowerCase() }))
    .filter(({ name }) => name !== "" && name.includes(wanted))
    .map((each) => ({ ...each, rank: each.name.startsWith(wanted) ? 0 : 1 }));
  ranked.sort((a, b) => a.rank - b.rank || (a.name < b.name ? -1 : 1));
  return ranked.slice(0, SHOWN).map(({ person }) => person);
}

/** Return the text with the query replaced by the name of a person, and the caret after it. */
export function withMention(
  text: string,
  query: MentionQuery,
  name: string,
): { text: string; caret: number } {
  const rest = text.slice(query.at + 1 + query.search.length);
  const written = `@${name}${/^\s/.test(rest) ? "" : " "}`;
  return {
    text: text.slice(0, query.at) + written + rest,
    caret: query.at + written.length,
  };
}

/**
 * Return the ids of the persons whom a text names as `@Name`, also by hand. Where two names begin
 * alike the longer one counts, and of several persons with one name those who were picked.
 */
export function mentionedIn(
  text: string,
  people: readonly MentionablePerson[],
  picked: ReadonlySet<string>,
): string[] {
  const byName = new Map<string, MentionablePerson[]>();
  for (const person of people) {
    if (person.name !== "") byName.set(person.name, [...(byName.get(person.name) ?? []), person]);
  }
  const names = [...byName.keys()].sort((a, b) => b.length - a.length);
  const found = new Set<string>();
  for (let at = text.indexOf("@"); at >= 0; at = text.indexOf("@", at + 1)) {
    if (at > 0 && PART_OF_A_NAME.test(text[at - 1] ?? "")) continue; // a mail address
    const name = names.find((each) => {
      const after = text[at + 1 + each.length] ?? "";
      return text.startsWith(each, at + 1) && !PART_OF_A_NAME.test(after);
    });
    const all = name === undefined ? [] : (byName.get(name) ?? []);
    const chosen = all.filter(({ id }) => picked.has(id));
    if (chosen.length > 0) for (const { id } of chosen) found.add(id);
    else if (all.length === 1 && all[0]) found.add(all[0].id);
  }
  return [...found].slice(0, MOST);
}
