/** A part of the page whose code is loaded when it is first needed, or before that when asked. */
import { type ComponentType, use } from "react";

/** The code of a part did not arrive: the server was updated meanwhile, or does not answer. */
export class PartMissing extends Error {
  /** The next one who needs the part asks for it again. */
  readonly forget: () => void;
  constructor(cause: unknown, forget: () => void) {
    super("A part of the page did not arrive.", { cause });
    this.name = "PartMissing";
    this.forget = forget;
  }
}

export type LazyPart<P> = ComponentType<P> & {
  /** Loads it, whatever comes of that: who needs it later is told. */
  preload: () => Promise<void>;
};

const unloaded: (() => Promise<void>)[] = [];

/** Loads every part that somebody may soon need one at a time: first what came with the newest part. */
export async function preloadParts(turn: () => Promise<void>): Promise<void> {
  for (let next = unloaded.pop(); next !== undefined; next = unloaded.pop()) {
    await turn();
    await next();
  }
}

/**
 * Suspends until the code is there; throws `PartMissing` for the boundary around it. A part that is
 * `heavy` is never loaded before somebody asks for it.
 */
export function lazyPart<P extends object>(
  load: () => Promise<ComponentType<P>>,
  { heavy = false } = {},
): LazyPart<P> {
  let loading: Promise<ComponentType<P>> | null = null;
  let loaded: ComponentType<P> | null = null;
  const forget = () => {
    loading = null;
  };
  const get = () => {
    loading ??= load().then(
      (part) => {
        loaded = part;
        return part;
      },
      (cause: unknown) => {
        throw new PartMissing(cause, forget);
      },
    );
    return loading;
  };
  // biome-ignore lint/correctness/noComponentHookFactories: called once for a part, in a module
  function Part(props: P) {
    // What is there already is drawn at once: a promise would wait for a turn, and show that.
    const Loaded = loaded ?? use(get());
    return <Loaded {...props} />;
  }
  const preload = () => get().then(() => {}, forget);
  if (!heavy) unloaded.push(preload);
  return Object.assign(Part, { preload });
}
