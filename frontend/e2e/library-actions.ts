/** What tests of the library have in common: actions, graphs that use them, and the page's list. */

import type { Locator, Page } from "@playwright/test";
import type { Product } from "./product";

export const leaf = (kind: string, more: object = {}) => ({ pvf_type: kind, ...more });

export const action = (name: string, input_parameters: object) => ({
  ...{ name, instance_id: 0, type: "sync", input_parameters },
});

export const list = (page: Page): Locator => page.getByRole("navigation", { name: "Actions" });

/** Chooses files as a person does. */
export async function choose(page: Page, files: { name: string; body: object }[]): Promise<void> {
  const chooser = page.waitForEvent("filechooser");
  await page.getByRole("button", { name: "Import", exact: true }).click();
  const mimeType = "application/json";
  await (await chooser).setFiles(
    files.map(({ name, body }) => ({ name, mimeType, buffer: Buffer.from(JSON.stringify(body)) })),
  );
}

export function post(product: Product, path: string, body: object): Promise<{ id: string }> {
  const headers = { "content-type": "application/json" };
  return product.ask(path, { method: "POST", body: JSON.stringify(body), headers });
}

/** The id of a graph of one action. */
export async function using(
  product: Product,
  graph_name: string,
  one: ReturnType<typeof action>,
): Promise<string> {
  const end = { name: one.name, instance_id: 0 };
  const graph = { graph_name, graph_entry: [end], graph_exit: [end], actions: [one] };
  return (await post(product, "/api/graphs", graph)).id;
}
