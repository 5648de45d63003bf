/** Tests in Debian's Chromium against the real processes, which each test file starts for itself. */

import { existsSync } from "node:fs";
import { defineConfig, devices } from "@playwright/test";
import { anotherDay } from "./e2e/turns";

// No test speaks to another machine, whatever robots it registers.
process.env.ROS_AUTOMATIC_DISCOVERY_RANGE = "LOCALHOST";

// Without the code for windows the same engine starts sooner and leaves more of the processors.
const SHELL = "/usr/bin/chromium-headless-shell";
export const CHROMIUM = process.env.CHROMIUM ?? (existsSync(SHELL) ? SHELL : "/usr/bin/chromium");

const launchOptions = {
  executablePath: CHROMIUM,
  args: [
    "--no-sandbox",
    "--disable-gpu",
    // There is none: the process that would serve it only costs, a twelfth of all that the tests take.
    "--in-process-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
  ],
};
/** Names of the network that lead to this computer: on plain http their pages are no secure context. */
export const LAN_ARGS = [
  ...launchOptions.args,
  "--host-resolver-rules=MAP lab.test 127.0.0.1, MAP robots.test 127.0.0.1",
];

const NAMED = ["lan.spec.ts", "proxy.spec.ts"];

/** Files of which each day, by UTC, tries one row, unless a file is named: they are far from STOP, starts and
 * stored edits, or try in other ways what others try. `make soak ARGS=browser` tries all. */
const TURNS = [
  [
    ...["review", "presence", "history", "extract", "help", "arrows", "phone", "people", "home"],
    ...["courses", "bends", "imports", "behaviours", "library-pane", "mentions"],
  ],
  [
    ...["robot-review", "versions", "library", "outline", "identity-provider", "graph-rights"],
    ...["programs", "touch", "lan", "first-view", "access", "administration", "audit"],
    ...["expanded", "packages", "note-links", "modify-run"],
  ],
  [
    ...["levels", "drafts", "browser-storage", "causes", "yjs-clients", "view-links"],
    ...["wrong-clock", "subgraphs", "problem-fixes", "inspector", "keyboard", "proxy"],
    ...["led-simulated", "drawing", "review-levels", "two-levels", "viewport"],
    ...["restored-backup", "library-robots", "robot-drills"],
  ],
];
const takesAll = process.env.TEST_LONG || process.argv.some((word) => word.includes(".spec"));
if (takesAll) process.env.TEST_ALL_TURNS = "1"; // for the processes that run the tests
const WAITING = TURNS.filter((_, row) => anotherDay(row) !== "")
  .flat()
  .map((name) => `${name}.spec.ts`);

export default defineConfig({
  testDir: "e2e",
  outputDir: "test-results",
  fullyParallel: false,
  // Each file starts its own product; two at a time use what one leaves idle while it waits. With three,
  // single tests took up to three times as long.
  workers: 2,
  // Two browsers and all that they drive share two cores there, which starves one of them now and then.
  // What passed only when it was tried again is told at the end: it is a fault to be found.
  retries: process.env.CI ? 1 : 0,
  forbidOnly: Boolean(process.env.CI),
  timeout: 90_000,
  expect: { timeout: 15_000 },
  reporter: [["list"], ["./e2e/failure-reporter.ts"]],
  use: {
    ...devices["Desktop Chrome"],
    viewport: { width: 1440, height: 900 },
    // Recording costs a good part of the processors, so in CI only what is tried again is recorded.
    trace: process.env.CI ? "on-first-retry" : "retain-on-failure",
    screenshot: "only-on-failure",
    actionTimeout: 15_000,
    // What moves is drawn by the processor here, sixty times a second. `make soak` looks at it in motion.
    contextOptions: { reducedMotion: process.env.TEST_LONG ? "no-preference" : "reduce" },
    // It would keep the page anew for each of them; offline.spec.ts is about it.
    serviceWorkers: "block",
    launchOptions,
  },
  projects: [
    { name: "here", testIgnore: [...NAMED, ...WAITING] },
    {
      name: "lan",
      testMatch: NAMED,
      use: { launchOptions: { ...launchOptions, args: LAN_ARGS } },
    },
  ],
});
