/** A part of the page whose code is loaded when it is first needed, or before that when asked. */

import { Button, Loader } from "@mantine/core";
import { IconPlugConnectedX } from "@tabler/icons-react";
import {
  Component,
  type ComponentType,
  type ReactNode,
  Suspense,
  use,
  useEffect,
  useRef,
  useState,
} from "react";
import { useFirstView } from "../clock/first-view";
import { Empty } from "./empty";
import style from "./lazy-part.module.css";

/** The code of a part did not arrive: the server was updated meanwhile, or does not answer. */
class PartMissing extends Error {
  /** The next one who needs the part asks for it again. */
  readonly forget: () => void;
  constructor(cause: unknown, forget: () => void) {
    super("A part of the page did not load.", { cause });
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

/** Shows progress after a second, and nothing before, so that fast parts do not flicker. */
function Loading() {
  return (
    <div className={style.loading} role="status" aria-busy>
      <Loader size="sm" type="dots" aria-hidden />
      <span>Loading …</span>
    </div>
  );
}

function Missing() {
  return (
    <div role="alert">
      <Empty
        icon={<IconPlugConnectedX size={22} />}
        title="This part of the page did not load"
        action={
          <Button variant="filled" onClick={() => location.reload()}>
            Reload the page
          </Button>
        }
      >
        The server does not answer, or it was updated while this page was open. Unsaved changes wait
        on this device; if that is not possible, the browser asks before it reloads.
      </Empty>
    </div>
  );
}

interface PartBoundaryProps {
  children: ReactNode;
  /** Returns the frame around a notice, for parts that bring their own frame. */
  frame?: (notice: ReactNode) => ReactNode;
  /** Instead of `Loading`. */
  waiting?: ReactNode;
}

export class PartBoundary extends Component<PartBoundaryProps, { error: unknown }> {
  override state = { error: null };

  static getDerivedStateFromError(error: unknown): { error: unknown } {
    return { error };
  }

  override componentDidCatch(error: unknown): void {
    if (error instanceof PartMissing) error.forget();
  }

  override render(): ReactNode {
    const { children, frame = (notice: ReactNode) => notice, waiting = <Loading /> } = this.props;
    const error: unknown = this.state.error;
    if (error instanceof PartMissing) return frame(<Missing />);
    if (error !== null) throw error;
    return <Suspense fallback={frame(waiting)}>{children}</Suspense>;
  }
}

/** A lazy part with a boundary of its own around it. */
export function boundedPart<P extends object>(
  load: () => Promise<ComponentType<P>>,
  boundary: Omit<PartBoundaryProps, "children"> = {},
): LazyPart<P> {
  const Part = lazyPart(load);
  // biome-ignore lint/correctness/noComponentHookFactories: called once for a part, in a module
  function Bounded(props: P) {
    return (
      <PartBoundary {...boundary}>
        <Part {...props} />
      </PartBoundary>
    );
  }
  return Object.assign(Bounded, { preload: Part.preload });
}

const over = (notice: ReactNode) => <div className={style.over}>{notice}</div>;

/** Wraps lazy parts that open over the page: *loading* and *not loaded* stand in the middle of the screen. */
export function OverlayBoundary({ children }: { children: ReactNode }) {
  return <PartBoundary frame={over}>{children}</PartBoundary>;
}

/** Wraps a lazy part that opens at a button: `button` is shown until the part brings its own. */
export function OpeningBoundary({ button, children }: { button: ReactNode; children: ReactNode }) {
  const beside = (notice: ReactNode) => (
    <>
      {button}
      {over(notice)}
    </>
  );
  return <PartBoundary frame={beside}>{children}</PartBoundary>;
}

const LATER_WITHIN = 1_000; // ms after the first drawing

/** Calls `work` once the page rests after the first view and what comes first here. `drawn`: the latter is drawn. */
export function useOnceIdle(drawn: boolean, work: () => void): void {
  const now = useRef(work);
  const isTime = useFirstView() && drawn;
  useEffect(() => (isTime ? whenIdle(() => now.current(), LATER_WITHIN) : undefined), [isTime]);
}

/** Draws its children, whose code is loaded then, after what comes first, once the page rests. */
export function Later(props: { drawn: boolean; children: ReactNode }): ReactNode {
  const [isTime, setTime] = useState(false);
  useOnceIdle(props.drawn, () => setTime(true));
  return isTime && props.children;
}

/** Draws its children, whose code is loaded then, once the first view is on screen. */
export function AfterFirstView({ children }: { children: ReactNode }): ReactNode {
  return useFirstView() && children;
}

const SOON = 500; // ms, in Safari, which does not say when that is

/**
 * Calls `work` then, or after `within` ms: a page that draws nothing may not be called idle for many seconds.
 * Returns what calls it off.
 */
export function whenIdle(work: () => void, within: number): () => void {
  if (typeof requestIdleCallback === "undefined") {
    const timer = setTimeout(work, SOON);
    return () => clearTimeout(timer);
  }
  const asked = requestIdleCallback(work, { timeout: within });
  return () => cancelIdleCallback(asked);
}
