/** How much code each page loads before it can be used, by the build of `npm run build` in `dist`. */
import { readdirSync, readFileSync } from "node:fs";
import { resolve } from "node:path";
import { gzipSync } from "node:zlib";
import { expect, test } from "vitest";

const DIST = resolve(import.meta.dirname, "../dist");

interface Chunk {
  readonly file: string;
  readonly name?: string;
  readonly imports?: readonly string[];
  readonly dynamicImports?: readonly string[];
}

/** What Vite wrote about its build. Without one nothing can be said, and that is no success. */
function built(): Readonly<Record<string, Chunk>> {
  try {
    return JSON.parse(readFileSync(resolve(DIST, ".vite/manifest.json"), "utf8"));
  } catch (error) {
    throw new Error("The page is not built: run `make setup`, or `npm run build` in frontend/.", {
      cause: error,
    });
  }
}

/** A chunk and all that has to be there before it runs. */
function needed(manifest: Readonly<Record<string, Chunk>>, ...from: string[]): Chunk[] {
  const found = new Map<string, Chunk>();
  const named = new Map(Object.entries(manifest).map(([key, { name }]) => [name, key]));
  const add = (entry: string) => {
    const key = entry in manifest ? entry : (named.get(entry) ?? entry);
    const chunk = manifest[key];
    if (chunk === undefined) throw new Error(`The build has no ${key}`);
    if (found.has(key)) return;
    found.set(key, chunk);
    for (const next of chunk.imports ?? []) add(next);
  };
  for (const key of from) add(key);
  return [...found.values()];
}

/** As servers send it, in kB of 1000 bytes. */
function sizeOf(chunk: Chunk): number {
  return gzipSync(readFileSync(resolve(DIST, chunk.file)), { level: 9 }).length / 1000;
}

const PAGE = "src/app/main.tsx";

/**
 * kB of JavaScript, gzipped. Who needs more makes something else wait: see `lazyPart`. A bound stands
 * a little above what its page has, so that it comes down only. "home" and "editor" are chunks of
 * `vite.config.ts`. What a browser really asks for is held by `first-view.spec.ts`.
 */
const BUDGETS: readonly (readonly [page: string, most: number, entries: readonly string[]])[] = [
  // With the sockets of several runners, and what proves a Stop at each: STOP needs nothing that is loaded later.
  ["STOP alone", 88.5, []],
  ["the list of graphs", 180.5, [PAGE, "home"]],
  ["the editor", 335.5, [PAGE, "editor"]],
  ["administration", 156.5, [PAGE, "src/administration/administration-page.tsx"]],
  ["robots", 239, [PAGE, "src/robots/robots-page.tsx"]],
];

test.each(BUDGETS)("%s needs at most %s kB of JavaScript", (_, most, entries) => {
  const chunks = needed(built(), "stop", ...entries);
  const sizes = chunks.map((chunk) => [Math.round(sizeOf(chunk) * 10), chunk.file] as const);
  const sum = sizes.reduce((all, [size]) => all + size, 0) / 10;
  const largest = sizes.sort(([a], [b]) => b - a).map(([size, file]) => `${size / 10} ${file}`);
  expect(sum, `${sum.toFixed(1)} kB:\n${largest.join("\n")}`).toBeLessThanOrEqual(most);
});

test("STOP needs React and its own file, so that no other part can fail to come and take it away", () => {
  const files = needed(built(), "stop").map(({ file }) => file);
  const names = files.map((file) => file.replace(/-[\w-]{8}\.js$/, ""));
  expect(names.sort()).toEqual(
    ["react", "rolldown-runtime", "stop"].map((name) => `assets/${name}`),
  );
  const scripts = readFileSync(resolve(DIST, "index.html"), "utf8").matchAll(
    /<script[^>]+src="\.\/([^"]+)"/g,
  );
  const [page, ...others] = [...scripts].map(([, file]) => file).reverse();
  expect(page).toMatch(/^assets\/page-/);
  expect(others.sort()).toEqual(files.sort());
});

test("the page has the styles of each component of Mantine in it, and no others", () => {
  const styles = resolve(import.meta.dirname, "../node_modules/@mantine/core/styles");
  const own = /m_[0-9a-f]{6,8}/g;
  const all = (suffix: string) =>
    readdirSync(resolve(DIST, "assets"))
      .filter((name) => name.endsWith(suffix))
      .map((name) => readFileSync(resolve(DIST, "assets", name), "utf8"))
      .join();
  const used = new Set(all(".js").match(own));
  const there = new Set(all(".css").match(own));
  const files = readdirSync(styles).filter((name) => name.endsWith(".layer.css"));
  const wrong = files.filter((name) => {
    const classes = readFileSync(resolve(styles, name), "utf8").match(own) ?? [];
    return classes.some((each) => used.has(each)) !== classes.some((each) => there.has(each));
  });
  expect(wrong).toEqual([]);
});

test("what is heavy and seldom used is loaded by nobody who has not asked for it", () => {
  const manifest = built();
  const pages = Object.keys(manifest).filter((key) =>
    /^src\/(app\/.*screens?|(administration|robots)\/.*-page)\.tsx$/.test(key),
  );
  const loaded = needed(manifest, "stop", PAGE, "home", "editor", ...pages).map(({ file }) => file);
  expect(pages.length).toBeGreaterThan(3);
  const heavy = /json-editor|start-dialog|share-dialog|elk/;
  expect(loaded.filter((file) => heavy.test(file))).toEqual([]);
});
