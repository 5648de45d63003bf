/** Tokens of programs, and programs that wait to be signed in, as both processes know them. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, renewing, runnerAt } from "../api/client";
import { errorText, Refusal } from "../api/http";
import type { EditorApi } from "../api/schema/editor";
import type { Role } from "../api/session";
import { isolated } from "../words/isolated";

export type TokenShown = EditorApi["TokenShown"];
export type MadeToken = EditorApi["MadeToken"];
export type LoginRequest = EditorApi["LoginRequest"];
export type Scope = TokenShown["record"]["scopes"][number];

interface ScopeWords {
  readonly scope: Scope;
  readonly label: string;
  /** The least role of a person who may give it. */
  readonly least: Role;
}

/** The scopes that a person can give; `hooks` is reserved. */
export const SCOPES = [
  { scope: "read", label: "See graphs, runs and robots, and stop runs", least: "viewer" },
  { scope: "edit", label: "Change graphs and publish versions", least: "editor" },
  { scope: "simulate", label: "Start and steer runs in the simulator", least: "editor" },
  { scope: "operate", label: "Start and steer runs on robots", least: "operator" },
  { scope: "scrape", label: "Read the metrics, for Prometheus", least: "viewer" },
] as const satisfies readonly ScopeWords[];

/** The meaning of `operate`, shown as soon as it is chosen. */
export const OPERATE_WORDS =
  "Real robots move when this program runs, in your name: runs show you, by this program. " +
  "Only for a program that you start yourself while you watch the robots.";

const INCLUDED: Partial<Record<Scope, readonly Scope[]>> = {
  edit: ["read"],
  simulate: ["read"],
  operate: ["read", "simulate"],
};

/** Return scopes together with those that they include, as the server completes them. */
export function completed(scopes: readonly Scope[]): Scope[] {
  return [...new Set([...scopes, ...scopes.flatMap((each) => INCLUDED[each] ?? [])])];
}

/** Return whether a token has expired: it then still stops runs. */
export function isOver(token: TokenShown, now: number): boolean {
  return 1000 * token.record.expires <= now;
}

const KEY = ["tokens"] as const;
const LOOK_MS = 10_000;

interface TokenList {
  tokens: TokenShown[];
  mostDays: number;
  /** The reason why the runner may not know all of them; "" if it does. */
  atRunner: string;
}

/** Return the later of two uses of a token, which the processes note by themselves. */
function laterUse(one: TokenShown, other: TokenShown["used"]): TokenShown {
  const { used } = one;
  return other != null && (used == null || used.at < other.at) ? { ...one, used: other } : one;
}

/**
 * List the tokens of the editor, with the last use at either process. A runner with a data folder of
 * its own is told of those that it does not know.
 */
async function listed(runner: string | undefined, signal: AbortSignal): Promise<TokenList> {
  const { tokens, most_days } = await editor.get("/api/tokens", { signal });
  if (runner === undefined) return { tokens, mostDays: most_days, atRunner: "" };
  const there = runnerAt(runner);
  try {
    const known = new Map(
      (await there.get("/api/tokens", { signal })).tokens.map(({ record, used }) => [
        record.id,
        used,
      ]),
    );
    for (const { record } of tokens) {
      if (!known.has(record.id)) await there.post("/api/tokens/records", { body: { record } });
    }
    const merged = tokens.map((each) => laterUse(each, known.get(each.record.id)));
    return { tokens: merged, mostDays: most_days, atRunner: "" };
  } catch (error) {
    return { tokens, mostDays: most_days, atRunner: errorText(error) };
  }
}

export function useTokens(runner: string | undefined) {
  return useQuery({
    queryKey: [...KEY, runner],
    queryFn: ({ signal }) => listed(runner, signal),
    refetchInterval: LOOK_MS,
  });
}

export function useMakeToken() {
  const client = useQueryClient();
  return useMutation({
    mutationFn: (body: EditorApi["MakeToken"]) => editor.post("/api/tokens", { body }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: KEY })),
  });
}

/** Ends a token at the editor, and at a runner that has a data folder of its own. */
export function useRevokeToken(runner: string | undefined) {
  const client = useQueryClient();
  return useMutation({
    mutationFn: async (token: string) => {
      const request = { path: { token } };
      // Each ends it by itself, whatever the other says.
      const [ofEditor, ofRunner] = await Promise.allSettled([
        editor.post("/api/tokens/{token}/revoke", request),
        runner === undefined
          ? Promise.reject(new Error("The page did not find the runner."))
          : runnerAt(runner).post("/api/tokens/{token}/revoke", request),
      ]);
      if (failed(ofEditor)) throw ofEditor.reason;
      if (failed(ofRunner)) throw new Error(`${NOT_AT_THE_RUNNER} ${errorText(ofRunner.reason)}`);
    },
    onSettled: renewing(() => client.invalidateQueries({ queryKey: KEY })),
  });
}

const NOT_AT_THE_RUNNER =
  "The token is revoked at the editor. A runner with a data folder of its own was not notified:";

/** A token that is not there any more has ended, as wanted. */
function failed(outcome: PromiseSettledResult<unknown>): outcome is PromiseRejectedResult {
  if (outcome.status === "fulfilled") return false;
  const { reason } = outcome;
  return !(reason instanceof Refusal && reason.details.status === 404);
}

/** The code in the address of the page, as `action-assistant login` prints it; "" without one. */
export function codeIn(hash: string): string {
  return /[#&]code=([A-Za-z-]{1,20})(?:&|$)/.exec(hash)?.[1]?.toUpperCase() ?? "";
}

/** Return the address from which a program asks, in words. */
export function placeWords(address: string): string {
  return address === "" ? "the server’s own computer" : isolated(address);
}

/** The program that waits with a code; asked again until it has fetched its token. */
export function useLogin(code: string) {
  return useQuery({
    queryKey: ["login", code],
    queryFn: ({ signal }) => editor.post("/api/logins/look", { body: { code }, signal }),
    enabled: code !== "",
    refetchInterval: ({ state }) => (state.data?.state === "fetched" ? false : 2_000),
    retry: false,
  });
}

export function useAnswer() {
  const client = useQueryClient();
  const settled = () => client.invalidateQueries({ queryKey: ["login"] });
  const confirm = useMutation({
    mutationFn: (body: EditorApi["ConfirmLogin"]) => editor.post("/api/logins/confirm", { body }),
    onSettled: settled,
  });
  const refuse = useMutation({
    mutationFn: (code: string) => editor.post("/api/logins/refuse", { body: { code } }),
  });
  return { confirm, refuse };
}

/** Renews the list of tokens: a program has fetched its own. */
export function useRenewTokens(): () => Promise<void> {
  const client = useQueryClient();
  return () => client.invalidateQueries({ queryKey: KEY });
}
