/**
 * Reads and writes comments on actions: threads in the document, with one key for each message.
 *
 * `comments` holds `<thread>/<message>` → JSON text. The first message of a thread names the action
 * that it is about, and the parameter if it is about one: apart, so that a page which knows of none
 * has the thread at the action. A message may also say that the thread is done, or open again. Messages are
 * never edited by others' pages, so two people who answer at once both stay. The author stands in
 * the text as the page wrote it; who stored it is known by the log.
 */
import type * as Y from "yjs";
import { newAid, rootOf } from "../document-keys";
import type { Key } from "../model";
import { asOneEdit, eraseKeys, writeKey } from "./document-writes";

interface CommentAuthor {
  readonly id: string;
  readonly name: string;
}

interface CommentMessage {
  readonly id: string;
  readonly author: CommentAuthor;
  /** The time, in milliseconds since 1970 by the clock of the writer. */
  readonly at: number;
  readonly text: string;
}

export interface Thread {
  readonly id: string;
  /** The action; it may be gone. */
  readonly about: Key;
  /** `in/speed`: one of its parameters, under the name that it had then. Null: the action as a whole. */
  readonly parameter: string | null;
  readonly messages: readonly CommentMessage[];
  readonly resolved: boolean;
}

interface ParsedMessage extends CommentMessage {
  readonly thread: string;
  readonly about: Key | null;
  readonly parameter: string | null;
  readonly resolved: boolean | null;
}

const text = (value: unknown, most: number): string =>
  typeof value === "string" ? value.slice(0, most) : "";

/** One message as somebody wrote it; null when it is none. */
function said(key: string, value: unknown): ParsedMessage | null {
  const [thread, id, ...more] = key.split("/");
  if (!thread || !id || more.length > 0 || typeof value !== "string") return null;
  let body: unknown;
  try {
    body = JSON.parse(value);
  } catch {
    return null;
  }
  if (typeof body !== "object" || body === null) return null;
  const fields = body as Record<string, unknown>;
  const { about, parameter, author, at, text: words, resolved } = fields;
  const who = typeof author === "object" && author !== null ? author : {};
  return {
    thread,
    id,
    about: typeof about === "string" ? about : null,
    parameter: text(parameter, 1_000) || null,
    author: {
      id: text(Reflect.get(who, "id"), 100),
      name: text(Reflect.get(who, "name"), 100),
    },
    at: typeof at === "number" && Number.isFinite(at) ? at : 0,
    text: text(words, 10_000),
    resolved: typeof resolved === "boolean" ? resolved : null,
  };
}

/** The threads of a document, the newest talk first. Never fails; skips what is none. */
export function readThreads(comments: Iterable<readonly [string, unknown]>): Thread[] {
  const threads = new Map<string, ParsedMessage[]>();
  for (const [key, value] of comments) {
    const message = said(key, value);
    if (message === null) continue;
    const known = threads.get(message.thread);
    if (known) known.push(message);
    else threads.set(message.thread, [message]);
  }
  const found: Thread[] = [];
  for (const [id, all] of threads) {
    all.sort((a, b) => a.at - b.at || (a.id < b.id ? -1 : 1));
    const first = all.find((message) => message.about !== null);
    const messages = all.filter((message) => message.text !== "");
    if (first?.about == null || messages.length === 0) continue;
    const { about, parameter } = first;
    const last = all.filter((message) => message.resolved !== null).at(-1);
    found.push({ id, about, parameter, messages, resolved: last?.resolved ?? false });
  }
  const newest = (thread: Thread) => thread.messages.at(-1)?.at ?? 0;
  return found.sort((a, b) => newest(b) - newest(a) || (a.id < b.id ? -1 : 1));
}

/** Returns the number of open threads for each action. */
export function openThreadCounts(threads: readonly Thread[]): Map<Key, number> {
  const counts = new Map<Key, number>();
  for (const { about, resolved } of threads) {
    if (!resolved) counts.set(about, (counts.get(about) ?? 0) + 1);
  }
  return counts;
}

interface Words {
  readonly author: CommentAuthor;
  readonly at: number;
  readonly text: string;
  /** The ids of the persons whom the text mentions. */
  readonly mentions?: readonly string[];
}

/** Begins a thread about an action, or one of its parameters. Returns its id. */
export function beginThread(
  doc: Y.Doc,
  about: Key,
  { author, at, text: words, mentions }: Words,
  parameter: string | null = null,
): string {
  const thread = newAid();
  const place = parameter === null ? { about } : { about, parameter };
  write(doc, thread, { ...place, author, at, text: words, ...named(mentions) });
  return thread;
}

export function reply(doc: Y.Doc, thread: string, words: Words): void {
  const { author, at, text: said, mentions } = words;
  write(doc, thread, { author, at, text: said, ...named(mentions) });
}

/** Returns the field of a comment that mentions somebody, no field for another: the server looks for its name. */
const named = (mentions: readonly string[] = []) => (mentions.length > 0 ? { mentions } : {});

/** Says that a thread is done, or that it is not. */
export function resolve(
  doc: Y.Doc,
  thread: string,
  resolved: boolean,
  { author, at }: Omit<Words, "text">,
): void {
  write(doc, thread, { author, at, resolved });
}

/** Deletes one message of a thread. */
export function deleteMessage(doc: Y.Doc, thread: string, message: string): void {
  const key = `${thread}/${message}`;
  const first = said(key, rootOf(doc, "comments").get(key));
  asOneEdit(doc, () => {
    // The first message names the action; without its words the answers still have their place.
    if (first?.about != null) {
      const { about, parameter, author, at } = first;
      const place = parameter === null ? { about } : { about, parameter };
      writeKey(doc, "comments", key, JSON.stringify({ ...place, author, at }));
    } else eraseKeys(doc, "comments", key);
  });
}

function write(doc: Y.Doc, thread: string, body: Readonly<Record<string, unknown>>): void {
  asOneEdit(doc, () => writeKey(doc, "comments", `${thread}/${newAid()}`, JSON.stringify(body)));
}
