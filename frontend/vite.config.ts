import { createHash } from "node:crypto";
import { readdirSync, readFileSync } from "node:fs";
import { resolve } from "node:path";
import react from "@vitejs/plugin-react";
import type { Plugin } from "vite";
import { defineConfig } from "vitest/config";

// `npm run dev` forwards what the page asks of its server to an editor on this machine.
const editor = process.env.ACTION_ASSISTANT_EDITOR ?? "http://127.0.0.1:8000";

/** Vendor code in few files that change seldom, so that an upgrade of ours leaves them cached. */
const vendors: { name: string; test: RegExp; tags?: "$initial"[] }[] = [
  { name: "react", test: /node_modules\/(react|react-dom|scheduler|use-sync-external-store)\// },
  { name: "canvas", test: /node_modules\/(@xyflow|d3-|classcat|zustand)/ },
  { name: "sync", test: /node_modules\/(yjs|y-protocols|lib0)\// },
  // What every page loads comes in one piece: it is smaller than in many, and asked for once.
  { name: "ui", test: /node_modules\//, tags: ["$initial"] },
  { name: "page", test: /src\/(?!offline\/(service-worker|requests))/, tags: ["$initial"] },
];

/** In the page only: parts of libraries that are large, and of which it uses nothing that is large. */
const substitutes = ["d3-color", "lib0/logging"].map((name) => ({
  find: new RegExp(`^${name}$`),
  replacement: resolve(import.meta.dirname, `substitutes/${name.replace("/", "-")}.ts`),
}));

const PUBLIC = resolve(import.meta.dirname, "public");
/** Fonts of scripts that few graphs are written in are kept when they are first shown. */
const SELDOM = /-(cyrillic|greek|vietnamese|latin)(-ext)?-wght.*woff2$/;
const OFTEN = /-latin-wght.*woff2$/;

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

export default defineConfig({
  plugins: [react(), pageVersion()],
  // The server writes the path at which a proxy shows the page into index.html.
  base: "./",
  resolve: { alias: substitutes },
  build: {
    outDir: "dist",
    manifest: true,
    target: "es2022",
    // Fonts inlined as data: would be refused by the Content-Security-Policy.
    assetsInlineLimit: 0,
    rolldownOptions: {
      // React Flow's components are made by these; what nobody draws of them is left out.
      treeshake: { manualPureFunctions: ["createContext", "forwardRef", "memo"] },
      input: {
        index: resolve(import.meta.dirname, "index.html"),
        "service-worker": resolve(import.meta.dirname, "src/offline/service-worker.ts"),
      },
      output: {
        codeSplitting: { groups: vendors },
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
      { extends: true, test: { name: "pure", include: ["src/**/*.test.ts"], isolate: false } },
      { extends: true, test: { name: "page", include: ["src/**/*.test.tsx"] } },
    ],
  },
});
