/**
 * Sites of which a list lacks their part, since they answered with an error or with what cannot be read, though
 * their live sockets are open. By the route of the list.
 */
import { useSyncExternalStore } from "react";
import type { Site } from "./sites";

export interface UnsaidSite {
  readonly site: Site;
  readonly why: string;
}

const NONE: readonly UnsaidSite[] = [];
const unsaid = new Map<string, readonly UnsaidSite[]>();
const listeners = new Set<() => void>();

/** Note which sites the newest answer to a route lacks. `route`: method and path, as OpenAPI has it. */
export function noteUnsaid(route: string, found: readonly UnsaidSite[]): void {
  if (found.length === 0 && !unsaid.has(route)) return;
  if (found.length === 0) unsaid.delete(route);
  else unsaid.set(route, found);
  for (const listener of [...listeners]) listener();
}

export const unsaidSites = (route: string): readonly UnsaidSite[] => unsaid.get(route) ?? NONE;

function subscribe(listener: () => void): () => void {
  listeners.add(listener);
  return () => listeners.delete(listener);
}

/** Return the sites that the newest answer to a route lacks. */
export function useUnsaidSites(route: string): readonly UnsaidSite[] {
  return useSyncExternalStore(subscribe, () => unsaidSites(route));
}
