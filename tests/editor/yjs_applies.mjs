/**
 * Applies updates with the page's own Yjs. Usage: node yjs_applies.mjs FRONTEND_FOLDER
 *
 * Reads a JSON list of cases from its input: `updates`, one after the other into a new document, and
 * `clocks` that the document should then have of each client, or null. Prints for each case what went
 * wrong, or null.
 */

import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";

const require = createRequire(join(resolve(process.argv[2]), "package.json"));
const Y = await import(pathToFileURL(require.resolve("yjs")).href);

/** Clocks of clients, those without any left out, in one order. */
function told(clocks) {
  return JSON.stringify(
    [...clocks].filter(([, clock]) => clock > 0).sort(([one], [other]) => one - other),
  );
}

function fault({ updates, clocks }) {
  const doc = new Y.Doc();
  try {
    for (const update of updates) {
      Y.applyUpdate(doc, Buffer.from(update, "hex"));
    }
    const state = Y.decodeStateVector(Y.encodeStateVector(doc));
    Y.applyUpdate(new Y.Doc(), Y.encodeStateAsUpdate(doc));
    if (doc.store.pendingStructs || doc.store.pendingDs) {
      return "something waits for ever";
    }
    if (clocks !== null && told(state) !== told(clocks)) {
      return `clocks ${told(state)}, not ${told(clocks)}`;
    }
    return null;
  } catch (error) {
    return String(error);
  }
}

process.stdout.write(JSON.stringify(JSON.parse(readFileSync(0, "utf8")).map(fault)));
