/** The inbox of the signed-in person, and the people whom a comment can mention. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { useMemo } from "react";
import { afterFirstView } from "../clock/first-view";
import { editor, renewing } from "./client";
import { useKnownPeople, usePerson } from "./people";
import type { EditorApi } from "./schema/editor";
import type { Person } from "./session";

export type Inbox = EditorApi["Inbox"];
export type Mention = EditorApi["Mention"];

/** The key of a person's own mentions: who signs in after somebody else sees none of theirs. */
const mentionsOf = ({ id }: Person) => ["mentions", id] as const;
const LOOK = 20_000; // ms; also while the page is not looked at, for notifications
const NO_IDS: readonly string[] = [];

export function useInbox() {
  const { person } = usePerson();
  return useQuery({
    queryKey: mentionsOf(person),
    queryFn: ({ signal }) =>
      afterFirstView(signal).then(() => editor.get("/api/mentions", { signal })),
    refetchInterval: LOOK,
    staleTime: LOOK / 2,
    refetchIntervalInBackground: true,
    retry: false,
  });
}

/** Marks mentions as read, on the page at once. */
export function useReadMentions() {
  const client = useQueryClient();
  const queryKey = mentionsOf(usePerson().person);
  return useMutation({
    mutationFn: (keys: readonly string[]) => editor.post("/api/mentions/read", { body: { keys } }),
    onMutate: async (keys) => {
      // An answer that was asked for before would bring them back as unread.
      await client.cancelQueries({ queryKey });
      client.setQueryData<Inbox>(queryKey, (inbox) => {
        if (inbox === undefined) return inbox;
        const mentions = inbox.mentions.map((each) =>
          keys.includes(each.key) ? { ...each, is_read: true } : each,
        );
        const read = inbox.mentions.filter((each, i) => each !== mentions[i] && !each.is_read);
        return { mentions, unread: inbox.unread - read.length };
      });
    },
    onSettled: renewing(() => client.invalidateQueries({ queryKey })),
  });
}

/** The place of a comment on the page. */
export const mentionPath = ({ graph, key }: Pick<Mention, "graph" | "key">): string =>
  `/graphs/${graph}?comment=${encodeURIComponent(key)}`;

/** Everyone whom a comment can mention: who has acted here, and persons with personal links. */
export function useMentionable(me: string): readonly { id: string; name: string }[] {
  const known = useKnownPeople(NO_IDS);
  const { data } = useQuery({
    queryKey: ["members", "mentionable"],
    queryFn: ({ signal }) => editor.get("/api/members", { signal }),
    staleTime: 60_000,
    retry: false,
  });
  return useMemo(() => {
    const ended = new Set(data?.people.filter((each) => each.ended_at != null).map((e) => e.id));
    const all = new Map(
      [...known, ...(data?.people ?? [])].map(({ id, name }) => [id, { id, name }]),
    );
    return [...all.values()].filter(({ id, name }) => name && id !== me && !ended.has(id));
  }, [known, data, me]);
}
