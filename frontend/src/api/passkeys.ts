/** Passkeys: registered on this device, and shown again to confirm that it is the same person. */
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { editor, renewing, runnerAt } from "./client";
import type { EditorApi } from "./schema/editor";

export type Passkey = EditorApi["PasskeyShown"];

const PASSKEYS = ["passkeys"] as const;
const ADDRESS = /^[\d.]+$|:/;

/** Return whether browsers allow passkeys on this page: under a name with TLS, or on localhost. */
export function offersPasskeys(): boolean {
  const { hostname } = location;
  return (
    window.isSecureContext &&
    !ADDRESS.test(hostname) &&
    typeof PublicKeyCredential === "function" &&
    "parseRequestOptionsFromJSON" in PublicKeyCredential
  );
}

export function usePasskeys() {
  return useQuery({
    queryKey: PASSKEYS,
    queryFn: ({ signal }) => editor.get("/api/passkeys", { signal }),
  });
}

/** Returns a mutation that renews the list of passkeys when it is settled. */
function usePasskeyMutation<T, R>(mutationFn: (value: T) => Promise<R>) {
  const client = useQueryClient();
  return useMutation({
    mutationFn,
    onSettled: renewing(() => client.invalidateQueries({ queryKey: PASSKEYS })),
  });
}

/** Registers a passkey on this device, under a name. */
export function useRegisterPasskey() {
  return usePasskeyMutation(async (name: string) => {
    const { options } = await editor.post("/api/passkeys/challenge", {});
    const publicKey = PublicKeyCredential.parseCreationOptionsFromJSON(
      options as unknown as PublicKeyCredentialCreationOptionsJSON,
    );
    const made = asPublicKey(await navigator.credentials.create({ publicKey }));
    return editor.post("/api/passkeys", { body: { name, credential: made.toJSON() } });
  });
}

export function useRenamePasskey() {
  return usePasskeyMutation(({ passkey, name }: { passkey: string; name: string }) =>
    editor.patch("/api/passkeys/{passkey}", { path: { passkey }, body: { name } }),
  );
}

export function useRemovePasskey() {
  return usePasskeyMutation((passkey: string) =>
    editor.delete("/api/passkeys/{passkey}", { path: { passkey } }),
  );
}

/** Sets after how many minutes what only owners do asks this owner again; 0: never. */
export function useOwnerAsked() {
  return usePasskeyMutation((minutes: number) =>
    editor.put("/api/passkeys/ask-again", { body: { ask_again: minutes } }),
  );
}

/** Confirms with a passkey that it is the same person, and brings that to the runner. */
export async function confirmByPasskey(runner: string): Promise<void> {
  const { options } = await editor.post("/api/passkeys/confirm/challenge", {});
  const publicKey = PublicKeyCredential.parseRequestOptionsFromJSON(
    options as unknown as PublicKeyCredentialRequestOptionsJSON,
  );
  const shown = asPublicKey(await navigator.credentials.get({ publicKey }));
  const body = { credential: shown.toJSON() };
  const record = await editor.post("/api/passkeys/confirm", { body });
  await runnerAt(runner).post("/api/confirmations/records", { body: record });
}

function asPublicKey(made: Credential | null): PublicKeyCredential {
  if (!(made instanceof PublicKeyCredential)) throw new Error("The browser gave no passkey.");
  return made;
}
