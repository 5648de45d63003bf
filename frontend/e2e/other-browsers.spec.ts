/** The main job in Firefox and WebKit: drawn by keys, started, stopped; and on a phone by touch. */

import { expect, test } from "@playwright/test";
import { type Engine, missingBrowser, OtherBrowser } from "./other-browsers";
import { Product, TOKEN } from "./product";

const ENGINES: readonly Engine[] = ["Firefox", "WebKit"];
const ASKED = process.env.BROWSERS ? "" : "in other browsers than CI has: make browsers";
const product = new Product();

test.beforeAll(async () => {
  if (ASKED === "") await product.start();
});
test.afterAll(() => product.dispose());

interface Run {
  state: string;
}

const newest = async () =>
  (await product.ask<Run[]>("/api/runs", {}, product.runnerUrl))[0]?.state ?? "none";

const SAVED = 'document.body.innerText.includes("Saved")';

for (const engine of ENGINES) {
  test(`${engine}: a graph is drawn by keys, runs to its end, and another one is stopped`, async () => {
    test.skip(ASKED !== "", ASKED);
    test.skip(missingBrowser(engine) !== "", missingBrowser(engine));
    test.setTimeout(180_000);
    const browser = await OtherBrowser.open(engine, "mouse");
    try {
      await browser.go(`${product.url}/#t=${TOKEN}`);
      await browser.sees("search_aisles");
      await browser.press("button", "^New graph");
      await browser.until(`location.pathname.startsWith("/graphs/") && ${SAVED}`);
      await browser.type("a");
      await browser.until('document.activeElement?.role === "combobox"');
      await browser.type("Peek", "Enter");
      await browser.until('document.activeElement?.matches(".react-flow__node-action")');
      await browser.type("c", "1Rummage", "Enter");
      await browser.sees("Rummage");
      await browser.type("c", "exit", "Enter");
      await browser.until(SAVED);
      const path = await graphPath();
      const { actions } = await product.ask<{ actions: { name: string; parents?: object[] }[] }>(
        `/api${path}/umrf`,
      );
      expect(actions.map(({ name }) => name)).toEqual(["Peek", "Rummage"]);
      expect(actions[1]?.parents).toHaveLength(1);
      await browser.picture(test.info().outputPath("drawn.png"));
      await browser.press("button", "Run v1 in the simulator", 900);
      await expect.poll(newest, { timeout: 30_000 }).toBe("finished");
      await browser.sees("finished");

      await browser.go(`${product.url}/graphs/${await product.chain(60)}`);
      await browser.until(SAVED);
      await browser.press("button", "Run v1 in the simulator", 900);
      await expect.poll(newest).toBe("running");
      await browser.press("button", "Stop run|Stop everything");
      await expect.poll(newest).toBe("stopped");
      await browser.sees("stopped");
      await browser.picture(test.info().outputPath("stopped.png"));
    } finally {
      await browser.end();
    }
  });

  test(`${engine}: on a phone a graph is added to, started and stopped by touch`, async () => {
    test.skip(ASKED !== "", ASKED);
    test.skip(missingBrowser(engine) !== "", missingBrowser(engine));
    test.setTimeout(180_000);
    const browser = await OtherBrowser.open(engine, "touch");
    try {
      await browser.go(`${product.url}/#t=${TOKEN}`);
      await browser.sees("search_aisles");
      const id = await product.chain(30);
      await browser.go(`${product.url}/graphs/${id}`);
      await browser.until(SAVED);
      await browser.press("tab", "^Outline");
      await browser.press("button", "^Add an action");
      await browser.until('document.activeElement?.role === "combobox"');
      await browser.type("Report", "Enter");
      await browser.sees("Report");
      await expect
        .poll(async () => {
          const file = await product.ask<{ actions: object[] }>(`/api/graphs/${id}/umrf`);
          return file.actions.length;
        })
        .toBe(31);
      await browser.picture(test.info().outputPath("outline.png"));
      await browser.press("button", "Run v1 in the simulator", 900);
      await expect.poll(newest).toBe("running");
      await browser.press("button", "Stop run|Stop everything");
      await expect.poll(newest).toBe("stopped");
      await browser.picture(test.info().outputPath("stopped.png"));
    } finally {
      await browser.end();
    }
  });
}

async function graphPath(): Promise<string> {
  const graphs = await product.ask<{ id: string; name: string }[]>("/api/graphs");
  return `/graphs/${graphs.find(({ name }) => name.startsWith("task"))?.id}`;
}
