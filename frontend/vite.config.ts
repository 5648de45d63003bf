import react from "@vitejs/plugin-react";
import { defineConfig } from "vitest/config";

// `npm run dev` forwards what the page asks of its server to an editor on this machine.
const editor = process.env.ACTION_ASSISTANT_EDITOR ?? "http://127.0.0.1:8000";

/** Vendor code in few files that change seldom, so that an upgrade of ours leaves them cached. */
const vendors: { name: string; test: RegExp }[] = [
  { name: "react", test: /node_modules\/(react|react-dom|scheduler|use-sync-external-store)\// },
  { name: "canvas", test: /node_modules\/(@xyflow|d3-|classcat|zustand)/ },
  { name: "sync", test: /node_modules\/(yjs|y-protocols|lib0)\// },
];

export default defineConfig({
  plugins: [react()],
  // The server writes the path at which a proxy shows the page into index.html.
  base: "./",
  build: {
    outDir: "dist",
    manifest: true,
    target: "es2022",
    // Fonts inlined as data: would be refused by the Content-Security-Policy.
    assetsInlineLimit: 0,
    rolldownOptions: { output: { codeSplitting: { groups: vendors } } },
  },
  server: {
    port: 5173,
    proxy: {
      "/api": { target: editor, ws: true },
      "/healthz": editor,
    },
  },
  test: {
    include: ["src/**/*.test.{ts,tsx}"],
    environment: "node",
    // A busy machine is slow, and that is no fault of what is tested.
    testTimeout: 30_000,
  },
});
