/** Links to one run and one graph, without a name: in a frame of another site, and on a phone. */
import { createServer, type Server } from "node:http";
import type { AddressInfo } from "node:net";
import { expect, type Page, test } from "@playwright/test";
import { Product } from "./product";
import { violations } from "./valves";

const product = new Product();
const PICTURES = process.env.PICTURES_OF_LINKS;
let site: Server;
let framed = "";

/** The address of the other site: another host and another port than the server's. */
const siteUrl = () => `http://localhost:${(site.address() as AddressInfo).port}`;

test.beforeAll(async () => {
  site = createServer((_, answer) => {
    answer.setHeader("content-type", "text/html");
    answer.end(`<!doctype html><title>Wiki</title><h1>Our wiki</h1>${framed}`);
  });
  await new Promise<void>((done) => site.listen(0, "127.0.0.1", done));
  process.env.ACTION_ASSISTANT_FRAME_ORIGINS = siteUrl();
  await product.start();
});
test.afterAll(async () => {
  await product.dispose();
  site.close();
});

interface Version {
  id: string;
  digest: string;
  umrf: object;
}

/** Starts the graph in the simulator, where each action takes a minute; the id of the run. */
async function started(graph: string): Promise<string> {
  const json = { method: "POST", headers: { "content-type": "application/json" } };
  const path = `/api/graphs/${graph}/versions`;
  const { id, digest, umrf } = await product.ask<Version>(path, { ...json, body: "{}" });
  const script = { behaviours: { "*": [{ after_s: 60 }] } };
  const order = { version: id, digest, umrf, graph, engine: "simulator", request_id: "r", script };
  const init = { ...json, body: JSON.stringify(order) };
  return (await product.ask<{ id: string }>("/api/runs", init, product.runnerUrl)).id;
}

async function newLink(page: Page, kind: "run" | "graph", label: string): Promise<string> {
  await page.getByRole("button", { name: "Share", exact: true }).click();
  const dialog = page.getByRole("dialog", { name: "Share" });
  await dialog.getByText(`To look at this ${kind} only`).click();
  await dialog.getByLabel("For what").fill(label);
  await dialog.getByRole("button", { name: "New link" }).click();
  return dialog.getByLabel(new RegExp(`^Link for .*${label}`)).inputValue();
}

async function picture(page: Page, name: string): Promise<void> {
  if (PICTURES) await page.screenshot({ path: `${PICTURES}/${name}.png` });
}

test("a run is seen in a frame of another site, and a graph on a phone, without a name", async ({
  browser,
}) => {
  const owner = await product.person(browser, "Ada");
  const graph = await product.chain(3);
  const run = await started(graph);
  await owner.page.goto(`${product.url}/runs/${run}`);
  await expect(owner.page.getByRole("region", { name: "Timeline" })).toBeVisible();
  const link = await newLink(owner.page, "run", "The wiki");
  await owner.page.getByRole("button", { name: /^Embed: / }).click();
  await expect(owner.page.getByRole("button", { name: /^(Copied|Select and copy)/ })).toBeVisible();
  await picture(owner.page, "share-run");

  // A visitor of the wiki sees the run as it goes on, and has nothing to press.
  framed = `<iframe src="${link}" title="The run" width="900" height="520"
    sandbox="allow-scripts allow-same-origin"></iframe>`;
  const guest = await browser.newContext();
  const wiki = await guest.newPage();
  await wiki.goto(siteUrl());
  const frame = wiki.frameLocator("iframe");
  await expect(frame.getByRole("heading", { name: "chain_3" })).toBeVisible();
  await expect(frame.getByText("running").first()).toBeVisible();
  await expect(frame.getByText("Looking only. Stop is on the page of this server")).toBeVisible();
  await expect(frame.getByRole("button", { name: /stop/i })).toHaveCount(0);
  await expect(frame.locator(".react-flow__node-action").first()).toContainText("Wait");
  await picture(wiki, "embedded");
  expect(await guest.cookies()).toEqual([]);
  await product.ask(`/api/runs/${run}/stop`, { method: "POST" }, product.runnerUrl);
  await expect(frame.getByText("stopped").first()).toBeVisible();
  await expect(frame.getByText("Ada")).toHaveCount(0);

  // The owner who opens it stays who she is.
  const tab = await owner.context.newPage();
  await tab.goto(link);
  await expect(tab.getByText("Looking only.")).toBeVisible();
  await expect(tab.locator(".react-flow__node-action")).toHaveCount(3);
  await picture(tab, "run-desktop");
  await owner.page.goto(`${product.url}/graphs/${graph}`);
  await expect(owner.page.getByRole("button", { name: /^You are Ada/ })).toBeVisible();
  await expect(owner.page.getByText("Saved", { exact: true })).toBeVisible();

  const phone = await browser.newContext({ viewport: { width: 390, height: 844 }, hasTouch: true });
  const seen = await phone.newPage();
  const failures: string[] = [];
  seen.on("pageerror", (error) => failures.push(error.message));
  await seen.goto(await newLink(owner.page, "graph", "A visitor"));
  await expect(seen.getByRole("list", { name: "Actions" }).getByRole("listitem")).toHaveCount(3);
  await picture(seen, "graph-phone-actions");
  await seen.locator(".react-flow__node-action").first().tap();
  const details = seen.getByRole("complementary", { name: "Details" });
  await expect(details.getByRole("heading", { name: /^Wait_\d$/ })).toBeVisible();
  await picture(seen, "graph-phone");
  expect(await violations(seen)).toEqual([]);
  await product.ask(`/api/graphs/${graph}`, {
    method: "PATCH",
    body: JSON.stringify({ name: "renamed" }),
    headers: { "content-type": "application/json" },
  });
  await expect(seen.getByRole("heading", { name: "renamed" })).toBeVisible();
  await owner.page.getByRole("button", { name: /^Revoke the link for/ }).click();
  await owner.page.getByRole("button", { name: "Revoke now" }).click();
  await expect(seen.getByText("This link was revoked.")).toBeVisible();
  await expect(seen.getByText("Wait")).toHaveCount(0);
  expect([...owner.failures, ...failures]).toEqual([]);
  await guest.close();
  await phone.close();
});
