/** Lists the graphs that this device keeps, with their names, for the time when no server gives a list. */
import * as Y from "yjs";
import { rootOf } from "../graph/document-keys";
import { browserStore, type EditStore, type KeptGraph } from "./indexed-db";

export interface NamedGraph extends KeptGraph {
  /** "" where it has none. */
  readonly name: string;
}

/** Returns the graphs of which this person has a copy here. Rejects where the browser stores nothing. */
export async function keptGraphs(
  person: string,
  store: EditStore = browserStore(),
): Promise<readonly NamedGraph[]> {
  const named: NamedGraph[] = [];
  for (const kept of await store.graphs(person)) {
    const owner = { graph: kept.graph, person: { id: person, name: "" } };
    const copy = (await store.read(owner)).at(-1);
    if (copy === undefined) continue;
    const doc = new Y.Doc();
    const updates = [...copy.known, ...copy.waiting.map(({ update }) => update)];
    for (const update of updates) Y.applyUpdate(doc, update);
    const name = rootOf(doc, "meta").get("name");
    named.push({ ...kept, name: typeof name === "string" ? name : "" });
    doc.destroy();
  }
  return named;
}

/** Deletes this person's copies when they sign out. Copies with edits or choices that wait stay. */
export async function leaveDevice(
  person: string,
  store: EditStore = browserStore(),
): Promise<void> {
  try {
    await store.leave(person);
  } catch (error) {
    console.warn("Copies of graphs stay on this device:", error);
  }
}
