/**
 * Keeps the page itself on the device, so that it opens without a server. It keeps no answer of the
 * API and sends nothing: what a person asks for while nobody answers fails at once, and says so.
 */
import { handlingOf, isServerGone, outdated, storeName } from "./requests";

/** Written in by the build: this version of the page, and all it consists of. */
declare const __VERSION__: string;
declare const __FILES__: readonly string[];

/** The parts of a worker that are used here; the page's own types are those of a window. */
interface Waiting extends Event {
  waitUntil(work: Promise<unknown>): void;
}
interface Fetching extends Waiting {
  readonly request: Request;
  respondWith(answer: Promise<Response>): void;
}
interface Worker {
  readonly registration: { readonly scope: string };
  readonly clients: { claim(): Promise<void> };
  skipWaiting(): Promise<void>;
  addEventListener(type: "install" | "activate", listener: (event: Waiting) => void): void;
  addEventListener(type: "fetch", listener: (event: Fetching) => void): void;
}

const worker = globalThis as unknown as Worker;
const { scope } = worker.registration;
const STORE = storeName(__VERSION__);
const PAGE = new URL("./", scope).href;
/** The server has this time to answer for the page before the stored one is shown, ms. */
const PATIENCE = 4_000;

/** All or nothing: with one part missing the version before stays. */
async function keepAll(): Promise<void> {
  const store = await caches.open(STORE);
  for (const file of __FILES__) {
    const url = new URL(file, scope).href;
    const known = file.startsWith("assets/") ? await caches.match(url) : undefined;
    if (known === undefined) await store.add(new Request(url, { cache: "no-cache" }));
    else await store.put(url, known);
  }
  const page = await fetch(PAGE, { cache: "no-cache", headers: { accept: "text/html" } });
  const text = await page.clone().text();
  // A server that is being updated may give the page of another version.
  if (!page.ok || !text.includes(__VERSION__)) throw new Error("The page is of another version.");
  await store.put(PAGE, page);
}

async function kept(url: string): Promise<Response | undefined> {
  const any = { ignoreVary: true };
  return (await (await caches.open(STORE)).match(url, any)) ?? caches.match(url, any);
}

/** Returns with what the server has, else with the stored copy. The page itself says what it does not reach. */
async function newest(request: Request, url: string): Promise<Response> {
  const late = new Promise<null>((resolve) => setTimeout(resolve, PATIENCE, null));
  const asked = fetch(request);
  const answer = await Promise.race([asked.catch(() => null), late]);
  if (answer !== null && !isServerGone(answer.status)) return answer;
  return (await kept(url)) ?? answer ?? asked;
}

async function partFor(request: Request): Promise<Response> {
  const known = await kept(request.url);
  if (known !== undefined) return known;
  const answer = await fetch(request);
  if (answer.ok) await (await caches.open(STORE)).put(request.url, answer.clone());
  return answer;
}

worker.addEventListener("install", (event) => {
  event.waitUntil(keepAll().then(() => worker.skipWaiting()));
});

worker.addEventListener("activate", (event) => {
  const forget = async () => {
    const names = outdated(await caches.keys(), __VERSION__);
    await Promise.all(names.map((name) => caches.delete(name)));
    await worker.clients.claim();
  };
  event.waitUntil(forget());
});

worker.addEventListener("fetch", (event) => {
  switch (handlingOf(event.request, scope)) {
    case "page":
      event.respondWith(newest(event.request, PAGE));
      break;
    case "sign":
      event.respondWith(newest(event.request, event.request.url));
      break;
    case "part":
      event.respondWith(partFor(event.request));
      break;
    case "pass":
      break;
  }
});
