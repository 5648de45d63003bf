/** Persons with personal links, their groups, and the devices on which people are signed in. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, renewing, runnerAt } from "./client";
import { errorText } from "./http";
import { serverPath } from "./page-url";
import type { EditorApi } from "./schema/editor";

export type Member = EditorApi["Member"];
export type Group = EditorApi["Group"];
export type OpenSession = EditorApi["OpenSession"];
export type DeviceCode = EditorApi["DeviceCode"];
export type DeviceAsking = EditorApi["DeviceAsking"];

const MEMBERS = ["members"] as const;
const SESSIONS = ["sessions"] as const;
const DEVICES = ["devices"] as const;
const LOOK = 4_000; // ms: who came in is seen soon

const NOT_AT_THE_RUNNER =
  "Done at the editor. A runner with a data folder of its own was not told:";

export function useMembers() {
  return useQuery({
    queryKey: MEMBERS,
    queryFn: ({ signal }) => editor.get("/api/members", { signal }),
    refetchInterval: LOOK,
  });
}

export function useSessions() {
  return useQuery({
    queryKey: SESSIONS,
    queryFn: ({ signal }) => editor.get("/api/sessions", { signal }),
    refetchInterval: LOOK,
  });
}

export function useDevices() {
  return useQuery({
    queryKey: DEVICES,
    queryFn: ({ signal }) => editor.get("/api/devices", { signal }),
    refetchInterval: LOOK,
  });
}

/** Stores the present rights of a person at a runner, which may have a data folder of its own. */
async function tellRunner(runner: string | undefined, member: Member): Promise<void> {
  if (runner === undefined) return;
  const { id, name, role, groups, until } = member;
  const body = { id, name, role, groups, until: until ? Date.parse(until) / 1000 : null };
  try {
    await runnerAt(runner).put("/api/members/{person}", { path: { person: id }, body });
  } catch (error) {
    throw new Error(`${NOT_AT_THE_RUNNER} ${errorText(error)}`);
  }
}

/** Returns a mutation that renews all lists of people and devices when it is settled. */
function usePeopleMutation<T, R>(mutationFn: (value: T) => Promise<R>) {
  const client = useQueryClient();
  return useMutation({
    mutationFn,
    onSettled: renewing(() =>
      Promise.all(
        [MEMBERS, SESSIONS, DEVICES].map((queryKey) => client.invalidateQueries({ queryKey })),
      ),
    ),
  });
}

export function useAddMember(runner: string | undefined) {
  return usePeopleMutation(async (body: EditorApi["NewMember"]) => {
    const made = await editor.post("/api/members", { body });
    await tellRunner(runner, made);
    return made;
  });
}

export function useChangeMember(runner: string | undefined) {
  return usePeopleMutation(
    async ({ person, body }: { person: string; body: EditorApi["MemberChange"] }) => {
      const changed = await editor.patch("/api/members/{person}", { path: { person }, body });
      await tellRunner(runner, changed);
    },
  );
}

export function useLinkMember() {
  return usePeopleMutation((person: string) =>
    editor.post("/api/members/{person}/link", { path: { person }, body: {} }),
  );
}

/** Ends a person at the editor and at the runner; each puts them out by itself. */
export function useEndMember(runner: string | undefined) {
  return usePeopleMutation(async (person: string) => {
    const told: Promise<unknown>[] = [
      editor.post("/api/members/{person}/end", { path: { person } }),
    ];
    if (runner !== undefined) {
      told.push(runnerAt(runner).post("/api/revocations", { body: { person } }));
    }
    const [first, second] = await Promise.allSettled(told);
    if (first?.status === "rejected") throw first.reason;
    if (second?.status === "rejected") {
      throw new Error(`${NOT_AT_THE_RUNNER} ${errorText(second.reason)}`);
    }
  });
}

/** Ends a session at the editor and at the runner. `own`: one of one's own devices. */
export function useEndSession(runner: string | undefined) {
  return usePeopleMutation(async ({ session, own }: { session: string; own: boolean }) => {
    const path = { session };
    if (own) {
      // The runner does not know whose session it is: the editor's seal says so.
      const { sessions, ends } = await editor.get("/api/devices", {});
      await editor.post("/api/devices/{session}/end", { path });
      const person = sessions.find((each) => each.id === session)?.person.id;
      const seal = ends[session];
      if (runner === undefined || person === undefined || seal === undefined) return;
      const body = { session, person, seal };
      await runnerAt(runner).post("/api/sessions/ended", { body });
      return;
    }
    await editor.post("/api/sessions/{session}/end", { path });
    if (runner === undefined) return;
    await runnerAt(runner).post("/api/revocations", { body: { session } });
  });
}

export function useEndSessionsOf() {
  return usePeopleMutation((person: string) =>
    editor.post("/api/people/{person}/sessions/end", { path: { person } }),
  );
}

export function useMakeGroup() {
  return usePeopleMutation((name: string) => editor.post("/api/groups", { body: { name } }));
}

export function useRemoveGroup() {
  return usePeopleMutation((group: string) =>
    editor.delete("/api/groups/{group}", { path: { group } }),
  );
}

export function makeDeviceCode(): Promise<DeviceCode> {
  return editor.post("/api/devices/codes", {});
}

export function lookAtDevice(code: string): Promise<DeviceAsking> {
  return editor.get("/api/devices/codes/{code}", { path: { code } });
}

export function answerDevice(code: string, yes: boolean): Promise<unknown> {
  return editor.post("/api/devices/codes/{code}/answer", { path: { code }, body: { yes } });
}

export function cancelDeviceCode(code: string): Promise<unknown> {
  return editor.delete("/api/devices/codes/{code}", { path: { code } });
}

/**
 * Return the address of a picture (QR code) of the link of a person. `origin`: where the link leads, as
 * "https://host:port".
 */
export function memberCodeUrl(person: string, origin: string): string {
  const path = `/api/members/${encodeURIComponent(person)}/qr`;
  return serverPath(`${path}?origin=${encodeURIComponent(origin)}`);
}

/** Return the address of a picture (QR code) with which a device is added. `origin`: as for `memberCodeUrl`. */
export function deviceCodeUrl(code: string, origin: string): string {
  const path = `/api/devices/codes/${encodeURIComponent(code)}/qr`;
  return serverPath(`${path}?origin=${encodeURIComponent(origin)}`);
}
