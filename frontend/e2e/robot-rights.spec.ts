/** Two people and one robot with a baton: taken, refused, taken over, handed over; out of service. */

import { expect, type Page, test } from "@playwright/test";
import { saved } from "./canvas";
import { DOMAIN, NO_ROS, StandIn } from "./emulated-robot";
import { type Person, Product } from "./product";

test.skip(NO_ROS !== "", NO_ROS);
test.describe.configure({ mode: "serial" });

const product = new Product();
const david = new StandIn("David");
let ada: Person;
let ben: Person;
let graph: string;

const robot = (page: Page) => page.getByRole("article", { name: "David" });
const button = (page: Page, name: string | RegExp) => page.getByRole("button", { name });

async function more(page: Page, item: RegExp): Promise<void> {
  await button(page, "More about David").click();
  await page.getByRole("menuitem", { name: item }).click();
}

/** Takes a picture where somebody wants to look at it. */
async function picture(page: Page, name: string): Promise<void> {
  const folder = process.env.RIGHTS_PICTURES;
  if (folder) await page.screenshot({ path: `${folder}/${name}.png` });
}

test.beforeAll(async ({ browser }) => {
  david.start(product.data, { "*": { after_s: 1 } });
  await product.start();
  const registered = { name: david.name, domain: DOMAIN, get_service: david.path };
  await product.ask(
    "/api/robots",
    {
      method: "POST",
      body: JSON.stringify(registered),
      headers: { "content-type": "application/json" },
    },
    product.runnerUrl,
  );
  graph = await product.chain(1);
  ada = await product.person(browser, "Ada");
  ben = await product.person(browser, "Ben");
  for (const { page } of [ada, ben]) await page.goto(`${product.url}/robots`);
});

test.afterAll(async () => {
  await david.kill();
  expect([...ada.failures, ...ben.failures]).toEqual([]);
  await product.dispose();
});

test("of two people who want a baton one takes it, and the other sees who has it", async () => {
  await more(ada.page, /^Who may start here/);
  const form = ada.page.getByRole("dialog");
  await form.getByRole("switch", { name: "It has a baton" }).press("Space");
  await form.getByRole("button", { name: "Add a limit" }).click();
  await form.getByRole("textbox", { name: "Parameter" }).fill("torque");
  await form.getByRole("textbox", { name: "At most" }).fill("60");
  await form.getByRole("button", { name: "Add a limit" }).scrollIntoViewIfNeeded();
  await picture(ada.page, "form");
  const reports = form.getByRole("switch", { name: /reports whether its hardware stop/ });
  await reports.press("Space");
  await form.getByRole("textbox", { name: "Topic" }).fill("/estop");
  await picture(ada.page, "stop");
  await reports.press("Space");
  await form.getByRole("switch", { name: "The operator's page stays visible" }).press("Space");
  await form.getByRole("textbox", { name: "A led run waits after" }).fill("20");
  await picture(ada.page, "page");
  await form.getByRole("button", { name: "Add a check" }).click();
  const check = form.getByRole("group", { name: "check 1" });
  await check.getByRole("textbox", { name: "Topic" }).fill("/battery");
  await form.getByRole("button", { name: "Add a check" }).scrollIntoViewIfNeeded();
  await picture(ada.page, "health");
  await form.getByRole("button", { name: "Save" }).click();
  for (const { page } of [ada, ben])
    await expect(robot(page)).toContainText("Nobody has its baton");
  const unknown = "The battery of David is unknown: nobody publishes it";
  await expect(robot(ben.page)).toContainText(`${unknown}: /battery`);
  await robot(ada.page).getByRole("button", { name: "Take the baton" }).click();
  await expect(robot(ada.page)).toContainText("You have its baton");
  await expect(robot(ben.page)).toContainText("Ada has its baton");
  await expect(robot(ben.page)).toContainText("You may not start on David: Ada has its baton.");
  await picture(ada.page, "holder");
  await picture(ben.page, "other");
});

test("the start says who has the baton, and it is taken over there with a reason", async () => {
  const { page } = ben;
  await page.goto(`${product.url}/graphs/${graph}`);
  await saved(page);
  await button(page, "Choose where to start").click();
  await page.getByRole("checkbox", { name: /^David/ }).check();
  const looks = page.getByRole("list", { name: "Looked at on David" });
  await expect(looks).toContainText("Ada has its baton", { timeout: 30_000 });
  await expect(looks).toContainText("which the robot does not enforce: torque at most 60");
  await expect(looks).toContainText("after 60 s the run is stopped. It cannot be made to wait");
  await expect(looks).toContainText("battery of David is unknown: nobody publishes it (/battery)");
  // This page is visible, and has answered the runner.
  await expect(looks).not.toContainText("No visible page of Ben answers now");
  await expect(button(page, /A check prevents the start/)).toBeDisabled();
  await picture(page, "start");
  await looks.getByRole("button", { name: "Take it over …" }).click();
  await looks.getByRole("textbox", { name: /^Why you take over/ }).fill("Ada is at lunch");
  await page.keyboard.press("Enter");
  await expect(looks).toContainText("You hold the baton of David.");
  await expect(button(page, /^Start v1 on David/)).toBeEnabled({ timeout: 20_000 });
  await page.keyboard.press("Escape");
  await page.goto(`${product.url}/robots`);
  await robot(page).getByRole("button", { name: "Hand over …" }).click();
  await page.getByRole("menuitem", { name: /^To Ada/ }).click();
  await expect(robot(ada.page)).toContainText("You have its baton");
});

test("a robot that is out of service says so, and only who has locked it takes the lock off", async () => {
  const { page } = ben;
  await more(page, /^Put out of service/);
  await page.getByRole("dialog").getByRole("textbox", { name: "Why" }).fill("It leaks oil");
  await page.getByRole("dialog").getByRole("button", { name: "Put out of service" }).click();
  const banner = robot(ada.page).getByRole("region", { name: "David is out of service" });
  await expect(banner).toContainText("OUT OF SERVICE");
  await expect(banner).toContainText("It leaks oil");
  await expect(banner.getByRole("button", { name: /Stop/ })).toBeVisible();
  await picture(ada.page, "service");
  await ada.page.setViewportSize({ width: 390, height: 844 });
  await picture(ada.page, "phone");
  await button(page, "Take my lock off").click();
  await expect(banner).toBeHidden();
});
