/** Requests to the routes of both processes, typed by their OpenAPI, from `make types`. */
import { fetchAnswer, type RequestOptions } from "./http";
import type { EditorPaths } from "./schema/editor";
import type { RunnerPaths } from "./schema/runner";
import { routerOf } from "./sites";

type Method = "get" | "post" | "put" | "patch" | "delete";

/** The paths of a process that have a method. */
type PathOf<Paths, M extends Method> = {
  [P in keyof Paths]: Paths[P] extends { [method in M]: unknown } ? P : never;
}[keyof Paths];

type Operation<Paths, M extends Method, P> = P extends keyof Paths
  ? Paths[P] extends { [method in M]: infer O }
    ? O
    : never
  : never;

/** A parameter without a value is left out. */
type Query<T> = { readonly [K in keyof T]: T[K] | undefined } | URLSearchParams;

type Frozen<T> = T extends object ? { readonly [K in keyof T]: Frozen<T[K]> } : T;

/**
 * A UMRF file may also be text, which is sent as it is: its numbers stay as they are written. Bytes, which the OpenAPI
 * has as a string, are a blob.
 */
type Body<T> = T extends string ? Blob : string extends keyof T ? T | string : Frozen<T>;

interface Json<T> {
  content: { "application/json": T };
}

/** The path parameters, the query and the body that an operation takes. */
type Input<O> = (O extends { parameters: { path: infer T } } ? { readonly path: T } : unknown) &
  (O extends { parameters: { query: infer T } }
    ? { readonly query: Query<T> }
    : O extends { parameters: { query?: infer T } }
      ? { readonly query?: Query<T> }
      : unknown) &
  (O extends { requestBody: Json<infer T> }
    ? { readonly body: Body<T> }
    : O extends { requestBody?: Json<infer T> }
      ? { readonly body?: Body<T> }
      : unknown);

type Answers<O> = O extends { responses: infer R }
  ? { [S in keyof R]: R[S] extends Json<infer T> ? T : undefined }
  : never;

interface Options extends Omit<RequestOptions, "method" | "body"> {
  /** Reads the headers of an answer that is no refusal. */
  readonly onHeaders?: (headers: Headers) => void;
}

/** Sends a request and returns the JSON of the answer. Throws `Refusal` or `Unreachable`. */
type Send<Paths, M extends Method> = <
  P extends PathOf<Paths, M>,
  S extends keyof Answers<Operation<Paths, M, P>>,
>(
  path: P,
  /** `status`: the one of the wanted answer, where the answers of an operation differ in type. */
  request: Input<Operation<Paths, M, P>> & Options & { readonly status?: S },
) => Promise<Answers<Operation<Paths, M, P>>[S]>;

type Client<Paths> = { readonly [M in Method]: Send<Paths, M> };

interface Request extends Options {
  readonly path?: Readonly<Record<string, string | number>>;
  readonly query?: Readonly<Record<string, unknown>> | URLSearchParams;
  readonly body?: unknown;
  readonly status?: number;
}

function urlOf(route: string, { path = {}, query = {} }: Request): string {
  const url = route.replace(/\{(\w+)\}/g, (_, name) => encodeURIComponent(path[name] ?? ""));
  const given = Object.entries(query).filter(([, value]) => value != null);
  const text = new URLSearchParams(query instanceof URLSearchParams ? query : given).toString();
  return text === "" ? url : `${url}?${text}`;
}

async function send(
  origin: string,
  method: Method,
  route: string,
  request: Request,
): Promise<unknown> {
  const { path, query, status, onHeaders, ...options } = request;
  const verb = method.toUpperCase() as Uppercase<Method>;
  const response = await fetchAnswer(origin + urlOf(route, request), { method: verb, ...options });
  if (status !== undefined && response.status !== status) {
    throw new Error(`The server answered ${response.status} instead of ${status}.`);
  }
  onHeaders?.(response.headers);
  return response.status === 204 ? undefined : response.json();
}

/** `isOne`: also an address that stands for all sites is that of one runner. */
function clientOf<Paths>(origin: string, isOne = false): Client<Paths> {
  const bound = (method: Method) => (route: string, request: Request) => {
    const router = isOne ? undefined : routerOf(origin);
    if (router === undefined) return send(origin, method, route, request);
    return router.ask(`${method} ${route}`, request, (site, other) =>
      send(site.url, method, route, { ...request, ...other }),
    );
  };
  const client: Record<Method, (route: string, request: Request) => Promise<unknown>> = {
    get: bound("get"),
    post: bound("post"),
    put: bound("put"),
    patch: bound("patch"),
    delete: bound("delete"),
  };
  return client as Client<Paths>;
}

export const editor = clientOf<EditorPaths>("");

/** The client of the runner at this address; the page does not know it at first, and does not ask. */
export function runnerAt(address: string | undefined): Client<RunnerPaths> {
  return clientOf(address ?? "");
}

/** The client of one runner, also where its address is the one that stands for all sites. */
export function runnerOnlyAt(address: string): Client<RunnerPaths> {
  return clientOf(address, true);
}

/**
 * Return what a mutation does when it is settled: it renews what is shown, and waits for that if it succeeded.
 * After an error it can be tried again at once: a server that does not answer would hold it for minutes.
 */
export function renewing(renew: () => Promise<unknown>) {
  return (_: unknown, error: Error | null): Promise<unknown> | undefined => {
    const renewed = renew();
    return error === null ? renewed : undefined;
  };
}
