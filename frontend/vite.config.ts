import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { utimes, writeFile } from "node:fs/promises";
import { relative, resolve } from "node:path";
import { promisify } from "node:util";
import { brotliCompress, constants } from "node:zlib";
import react from "@vitejs/plugin-react";
import subsetFont from "subset-font";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

// `npm run dev` forwards what the page asks of its server to an editor on this machine.
const editor = process.env.ACTION_ASSISTANT_EDITOR ?? "http://127.0.0.1:8000";

/** Vendor code in few files that change seldom, so that an upgrade of ours leaves them cached; and what a
 * screen needs before it is drawn in one file, since each request costs as much as kilobytes. */
const chunks: { name: string; test: RegExp; tags?: "$initial"[]; minShareCount?: number }[] = [
  { name: "more-styles", test: /src\/ui\/mantine-more\.css/ },
  {
    name: "react",
    test: /node_modules\/(react|react-dom|scheduler|use-sync-external-store)\//,
  },
  {
    name: "canvas",
    test: /node_modules\/(@xyflow(?!.*\.css)|d3-|classcat|zustand|yjs|y-protocols|lib0)/,
  },
  // STOP needs nothing but this and React: see `app/stop-main.ts`.
  {
    name: "stop",
    test: /src\/(app\/stop-main|clock\/|words\/|runs\/stop\/(stop-|outside-)|api\/(live-(messages|socket)|runner-sockets|page-link|http|page-url|run-stop|session)|graph\/stop-basics|status\/help-link|ui\/(keys|times|tokens|watched|use-root-mark))/,
  },
  // What every page loads comes in one piece: it is smaller than in many, and asked for once.
  {
    name: "page",
    test: /(node_modules|src)\/(?!offline\/(service-worker|requests))/,
    tags: ["$initial"],
  },
  // What several screens share, the home page and the editor too: neither waits for the other.
  {
    name: "shared",
    test: /node_modules\/(@tabler\/|@mantine\/core\/esm\/components\/(ActionIcon|Kbd|Text|Paper|CopyButton|Skeleton)\/)|src\/(ui\/(copy-text|segments)|canvas\/(geometry\/ranks|outcome\.)|graph\/(json-members|problems\/problem-kinds)|status\/state-label|api\/inside|runs\/start\/use-start)/,
    minShareCount: 3,
  },
  // The home page, and what is drawn on every screen once the screen is.
  { name: "home", test: /src\/(ui\/messages|account\/notifier|app\/home-screen)\.tsx$/ },
  { name: "editor", test: /src\/app\/graph-screen\.tsx$/ },
  // Menus, dialogs and forms, of several screens each.
  {
    name: "overlays",
    test: /node_modules\/(?!@codemirror|@lezer|elkjs|mdast|micromark)/,
    minShareCount: 4,
  },
  { name: "forms", test: /src\/(ui|graph|words|people)\//, minShareCount: 4 },
  // What an editor loads once its graph is there.
  {
    name: "beside",
    test: /src\/(?!review).*\/(level-status|draft-status|sent-graph|sidebar|draft-bar|inspector|levels|since-marks|graph-print|lost-drafts|arrow-dialog|quick-add|command-palette|context-menu|find-bar|graph-form|graph-map|list-rail)\.tsx$/,
  },
];

/** In the page only: parts of libraries that are large, and of which it uses nothing that is large. */
const substitutes = ["d3-color", "lib0/logging"].map((name) => ({
  find: new RegExp(`^${name}$`),
  replacement: resolve(import.meta.dirname, `substitutes/${name.replace("/", "-")}.ts`),
}));

const tests = readdirSync(resolve(import.meta.dirname, "src"), { recursive: true })
  .map((name) => `src/${name}`)
  .filter((name) => /\.test\.tsx?$/.test(name));
/** Those that replace a module: of what others share it may be there already, and would stay replaced for them. */
const replacing = tests.filter((name) =>
  readFileSync(resolve(import.meta.dirname, name), "utf8").includes("vi.mock("),
);
const sharing = (suffix: string) =>
  tests.filter((name) => name.endsWith(`.test${suffix}`) && !replacing.includes(name));

const PUBLIC = resolve(import.meta.dirname, "public");
/** Fonts of scripts that few graphs are written in are kept when they are first shown. */
const SELDOM = /-(cyrillic|greek|vietnamese|latin)(-ext)?-wght.*woff2$/;
const OFTEN = /-latin-wght.*woff2$/;

/** The page around STOP is an entry of its own, so that a part of it that does not come takes no STOP away. */
const PAGE = "src/app/main.tsx";

/** Names the file of the page around STOP in index.html, and what has to be there before it runs. */
function pageScript(): Plugin {
  return {
    name: "page-script",
    apply: "build",
    enforce: "post",
    generateBundle(_, bundle) {
      const html = bundle["index.html"];
      const chunks = Object.values(bundle).filter((part) => part.type === "chunk");
      const entry = chunks.find((chunk) => chunk.facadeModuleId?.endsWith(PAGE));
      if (html?.type !== "asset" || entry === undefined) throw new Error(`no page, or no ${PAGE}`);
      // What is imported comes first, so that its styles give way to those of its importer.
      const needed = new Set<string>();
      const styles = new Set<string>();
      const add = (name: string) => {
        const chunk = bundle[name];
        if (chunk?.type !== "chunk" || needed.has(name)) return;
        for (const next of chunk.imports) add(next);
        needed.add(name);
        for (const style of chunk.viteMetadata?.importedCss ?? []) styles.add(style);
      };
      add(entry.fileName);
      const text = String(html.source);
      const links = [...needed, ...styles]
        .filter((name) => !text.includes(name))
        .map((name) => {
          const rel = styles.has(name) ? "stylesheet" : "modulepreload";
          return `<link rel="${rel}" crossorigin href="./${name}">`;
        });
      html.source = text
        .replace(/ src="[^"]*main\.tsx"( vite-ignore)?/, ` crossorigin src="./${entry.fileName}"`)
        .replace("</head>", `${links.join("")}</head>`);
    },
  };
}

/** Names this version of the page in it, and tells the service worker of what it consists. */
function pageVersion(): Plugin {
  return {
    name: "page-version",
    apply: "build",
    enforce: "post",
    generateBundle(_, bundle) {
      const page = bundle["index.html"];
      const worker = bundle["service-worker.js"];
      if (page?.type !== "asset" || worker?.type !== "chunk")
        throw new Error("no page, or no worker");
      const parts = Object.keys(bundle).filter((name) => name.startsWith("assets/"));
      const more = readdirSync(PUBLIC);
      const hash = createHash("sha256").update(`${page.source}\n${worker.code}`);
      for (const name of [...parts].sort()) hash.update(name);
      for (const name of more) hash.update(readFileSync(resolve(PUBLIC, name)));
      const version = hash.digest("hex").slice(0, 16);
      const files = [...parts.filter((name) => !SELDOM.test(name) || OFTEN.test(name)), ...more];
      page.source = String(page.source).replace(
        'name="build" content=""',
        `name="build" content="${version}"`,
      );
      worker.code = worker.code
        .replaceAll("__VERSION__", JSON.stringify(version))
        .replaceAll("__FILES__", JSON.stringify(files));
    },
  };
}

/** What the page shows of a font: its weights, distances between letters, and figures of one width. */
const USED = {
  variationAxes: { wght: { min: 400, max: 700 } },
  keepFeatures: ["kern", "tnum"],
};

/** Return all characters of a list of ranges such as `U+0000-00FF,U+0131`. */
function charactersIn(ranges: string): string {
  return ranges
    .split(",")
    .map((range) => {
      const [first = 0, last = first] = range
        .slice("U+".length)
        .split("-")
        .map((digits) => Number.parseInt(digits, 16));
      return String.fromCodePoint(...Array.from({ length: last - first + 1 }, (_, n) => first + n));
    })
    .join("");
}

/**
 * Takes out of the fonts of each first visit the weights and features that the page never shows: among them
 * ligatures, which show `->` as another sign than was typed.
 */
function narrowFonts(): Plugin {
  return {
    name: "narrow-fonts",
    apply: "build",
    async generateBundle(_, bundle) {
      for (const part of Object.values(bundle)) {
        if (part.type !== "asset" || !OFTEN.test(part.fileName)) continue;
        const name = /(inter|jetbrains-mono)-latin/.exec(part.fileName)?.[1];
        const list = `node_modules/@fontsource-variable/${name}/unicode.json`;
        const ranges: unknown = JSON.parse(
          readFileSync(resolve(import.meta.dirname, list), "utf8"),
        );
        const { latin } = ranges as { latin: string };
        part.source = await subsetFont(Buffer.from(part.source), charactersIn(latin), {
          targetFormat: "woff2",
          ...USED,
        });
      }
    },
  };
}

const brotli = promisify(brotliCompress);

/** Writes a compressed copy beside each script and stylesheet: that takes too long for a server, and saves a seventh. */
function compressed(): Plugin {
  return {
    name: "compressed",
    apply: "build",
    enforce: "post",
    async writeBundle({ dir = "" }, bundle) {
      const texts = Object.values(bundle).filter(({ fileName }) => /\.(js|css)$/.test(fileName));
      const copy = async (part: (typeof texts)[number]) => {
        const text = part.type === "chunk" ? part.code : part.source;
        const quality = text.length > 350_000 ? 9 : constants.BROTLI_MAX_QUALITY; // 13 times as quick
        const params = { [constants.BROTLI_PARAM_QUALITY]: quality };
        await writeFile(resolve(dir, `${part.fileName}.br`), await brotli(text, { params }));
      };
      await Promise.all(texts.map(copy));
      // The server reads all files when the index has changed.
      const now = new Date();
      await utimes(resolve(dir, "index.html"), now, now);
    },
  };
}

/** Properties by the first part of a utility that the scale of `ui/utilities.css` makes. */
const SCALED: Readonly<Record<string, string>> = {
  ...{ gap: "gap", w: "width", h: "height", z: "z-index", rounded: "border-radius" },
  ...{ m: "margin", mt: "margin-top", mb: "margin-bottom", ml: "margin-left", mr: "margin-right" },
  ...{ p: "padding", pt: "padding-top", pb: "padding-bottom", pl: "padding-left" },
  pr: "padding-right",
  ...{ "min-w": "min-width", "min-h": "min-height", "max-w": "max-width", "max-h": "max-height" },
  ...{ top: "top", bottom: "bottom", left: "left", right: "right" },
};

/** Return the declaration of a utility such as `p-50-75` or `min-h-44px`; null for other names. */
function scaled(name: string): string | null {
  const [, start = "", sizes = ""] =
    /^([a-z]+(?:-[wh])?)((?:-(?:[\d_]+(?:px)?|auto|full))+)$/.exec(name) ?? [];
  const property = SCALED[start];
  if (property === undefined) return null;
  const lengths = sizes
    .slice(1)
    .split("-")
    .map((size) => {
      const number = size.replace("_", ".");
      if (size === "auto" || size.endsWith("px") || size === "0") return number;
      if (size === "full") return "100%";
      if (start === "z") return number;
      return start === "rounded" ? `${number}px` : `${Number(number) / 100}rem`;
    });
  return `${property}: ${lengths.join(" ")};`;
}

/**
 * Replaces `@apply row gap-50;` in stylesheets by the declarations of these classes of `ui/utilities.css`:
 * rules stay short, and neither the cascade nor the size of the code changes.
 */
function applyUtilities(): Plugin {
  const text = readFileSync(resolve(import.meta.dirname, "src/ui/utilities.css"), "utf8");
  const rules = text.matchAll(/^\.([\w-]+) \{([^}]+)\}/gm);
  const utilities = new Map([...rules].map(([, name = "", body = ""]) => [name, body]));
  return {
    name: "apply-utilities",
    enforce: "pre",
    transform(code, id) {
      if (!id.endsWith(".css")) return null;
      return code.replace(/@apply ([^;]+);/g, (_, names: string) =>
        names.replace(/\S+/g, (name) => {
          const body = utilities.get(name) ?? scaled(name);
          if (body === null) throw new Error(`${id} applies ${name}, which is no utility.`);
          return body;
        }),
      );
    },
  };
}

/** Components of Mantine whose styles are in the first stylesheet; those of all others come with the first that needs one. */
const FIRST_STYLES = /@import "@mantine\/core\/styles\/(\w+)/g;
const MORE_STYLES = resolve(import.meta.dirname, "src/ui/mantine-more.css");

/** Has each component of Mantine import the stylesheet that its styles are in. */
function mantineStyles(): Plugin {
  const first = readFileSync(resolve(import.meta.dirname, "src/ui/mantine.css"), "utf8");
  const known = new Set([...first.matchAll(FIRST_STYLES)].map(([, name]) => name));
  return {
    name: "mantine-styles",
    transform(code, id) {
      const [, component] =
        /@mantine\/core\/esm\/(?:components|utils)\/(\w+)\/.*\.module\.mjs/.exec(id) ?? [];
      if (component === undefined || known.has(component)) return null;
      return { code: `import ${JSON.stringify(MORE_STYLES)};\n${code}`, map: null };
    },
  };
}

/** Return the name of a class in the build. A number of its line would change often, and compress badly. */
function className(name: string, file: string): string {
  const path = relative(import.meta.dirname, file);
  return `${name}_${createHash("sha256").update(path).digest("hex").slice(0, 5)}`;
}

export default defineConfig({
  plugins: [
    react(),
    applyUtilities(),
    mantineStyles(),
    narrowFonts(),
    pageScript(),
    pageVersion(),
    compressed(),
  ],
  // The server writes the path at which a proxy shows the page into index.html.
  base: "./",
  css: { modules: { generateScopedName: className } },
  resolve: { alias: substitutes },
  build: {
    outDir: "dist",
    manifest: true,
    reportCompressedSize: false,
    target: "es2022",
    // Browsers that do not know `modulepreload` load the same files a little later.
    modulePreload: { polyfill: false },
    // Fonts inlined as data: would be refused by the Content-Security-Policy.
    assetsInlineLimit: 0,
    rolldownOptions: {
      // React Flow's components are made by these; what nobody draws of them is left out.
      treeshake: { manualPureFunctions: ["createContext", "forwardRef", "memo"] },
      input: {
        index: resolve(import.meta.dirname, "index.html"),
        page: resolve(import.meta.dirname, PAGE),
        "service-worker": resolve(import.meta.dirname, "src/offline/service-worker.ts"),
      },
      output: {
        codeSplitting: { groups: chunks },
        // A worker reaches as far as the folder it lies in.
        entryFileNames: ({ name }) =>
          name === "service-worker" ? "[name].js" : "assets/[name]-[hash].js",
      },
    },
  },
  server: {
    port: 5173,
    proxy: {
      "/api": { target: editor, ws: true },
      "/healthz": editor,
    },
  },
  test: {
    environment: "node",
    pool: "threads",
    // Its own choice leaves one of two processors idle.
    maxWorkers: 2,
    // A busy machine is slow, and that is no fault of what is tested.
    testTimeout: 30_000,
    projects: [
      // What has no document leaves nothing behind, so its files share what they import.
      {
        extends: true,
        test: { name: "pure", include: sharing(".ts"), isolate: false },
      },
      {
        extends: true,
        test: { name: "page", include: sharing(".tsx"), isolate: false },
      },
      { extends: true, test: { name: "replacing", include: replacing } },
    ],
  },
});
