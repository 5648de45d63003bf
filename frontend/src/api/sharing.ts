/** Links that let people in, as owners see them. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, renewing, runnerAt } from "./client";
import { errorText } from "./http";
import { serverPath } from "./page-url";
import type { EditorApi } from "./schema/editor";

export type Guest = EditorApi["Guest"];
/**
 * `path` follows the origin of the page, and is absent once the link is revoked. `unrecorded`: nobody
 * comes in by it any more, though the log could not take that up yet.
 */
export type Invitation = EditorApi["Invitation"];
/**
 * `origins`: where others find the page, the likeliest first; empty when they cannot. `proxied`: the
 * first of these is shown by a proxy, whose certificate that is.
 */
export type Sharing = EditorApi["Sharing"];

const KEY = ["invitations"] as const;
const NOT_AT_THE_RUNNER =
  "The link is revoked at the editor. A runner with a data folder of its own was not notified:";
const LOOK = 4_000; // ms: who came in is seen soon

export function useSharing() {
  return useQuery({
    queryKey: KEY,
    queryFn: ({ signal }) => editor.get("/api/invitations", { signal }),
    refetchInterval: LOOK,
  });
}

export function useInvite() {
  const client = useQueryClient();
  return useMutation({
    mutationFn: (body: EditorApi["Inviting"]) => editor.post("/api/invitations", { body }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: KEY })),
  });
}

/** Ends a link at the editor, and at a runner that has a data folder of its own. */
export function useRevoke(runner: string | undefined) {
  const client = useQueryClient();
  return useMutation({
    mutationFn: async (invitation: string) => {
      const path = { invitation };
      const told: Promise<unknown>[] = [
        editor.post("/api/invitations/{invitation}/revoke", { path }),
      ];
      if (runner !== undefined) {
        told.push(runnerAt(runner).post("/api/revocations", { body: { invitation } }));
      }
      // Each puts them out by itself, whatever the other says.
      const outcomes = await Promise.allSettled(told);
      const failed = outcomes.findIndex((each) => each.status === "rejected");
      const outcome = outcomes[failed];
      if (outcome?.status !== "rejected") return;
      if (failed === 0) throw outcome.reason;
      throw new Error(`${NOT_AT_THE_RUNNER} ${errorText(outcome.reason)}`);
    },
    onSettled: renewing(() => client.invalidateQueries({ queryKey: KEY })),
  });
}

/** Return the address of a picture (QR code) of an invitation. `origin`: where it leads, as "https://host:port". */
export function codeUrl(invitation: string, origin: string): string {
  const path = `/api/invitations/${encodeURIComponent(invitation)}/qr`;
  return serverPath(`${path}?origin=${encodeURIComponent(origin)}`);
}
