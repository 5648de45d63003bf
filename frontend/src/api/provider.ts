/** Sign-in by the OpenID Connect provider of the server, where one is set. */
import { editor } from "./client";
import { basePath } from "./page-url";
import type { EditorApi } from "./schema/editor";
import { personIn } from "./session";

/** The place to which the provider sends the browser back. */
const RETURN_PATH = `${basePath}/signed-in`;

/** The contents of the address after a visit to the provider; `again`: a person wants to prove that it is
 * they, and has not been there yet. */
export type ProviderReturn =
  | { readonly kind: "answer"; readonly answer: EditorApi["ProviderAnswer"] }
  | { readonly kind: "again" };

/** Return what the provider sent the browser back with, and erase it from the address; null elsewhere. */
export function takeProviderReturn(): ProviderReturn | null {
  if (location.pathname !== RETURN_PATH) return null;
  const said = new URLSearchParams(location.search);
  const state = said.get("state");
  if (state === null) return said.has("again") ? { kind: "again" } : null;
  history.replaceState(history.state, "", RETURN_PATH);
  const part = (name: string) => said.get(name)?.replace(/\p{Cc}/gu, " ") ?? null;
  const [code, iss, error] = [part("code"), part("iss"), part("error")];
  const answer = { state, code, iss, error, error_description: part("error_description") };
  return { kind: "answer", answer };
}

/** Hand in the answer of the provider. Throws `Refusal` when it signs nobody in. Shows the page that the
 * person wanted to see in the address, which never leads to another site. */
export async function handInProviderAnswer(answer: EditorApi["ProviderAnswer"]) {
  const { goal, signed_in } = await editor.post("/api/session/provider/answer", { body: answer });
  const back = goal.startsWith(RETURN_PATH) ? `${basePath}/` : goal;
  if (signed_in) history.replaceState(history.state, "", back);
  return signed_in ? personIn(signed_in) : null;
}

/** Return the provider by which people may sign in at this address; its name is null without one. */
export function providerOffer(): Promise<EditorApi["ProviderOffer"]> {
  return editor.get("/api/session/provider", {});
}

/** The address of the page on which a person proves by the provider that it is they. */
export const PROOF_URL = `${RETURN_PATH}?again`;

/** Send the browser to the provider; it comes back to the page of now. Throws `Refusal` when the
 * provider does not answer. */
export async function visitProvider(again = false): Promise<void> {
  const goal = location.pathname + location.search + location.hash;
  const { url } = await editor.post("/api/session/provider", { body: { goal, again } });
  location.assign(url);
}
