/**
 * STOP with its key and its notices, as a root of its own beside the page: whatever breaks there, STOP
 * stands. It needs React, the link to the runner and its own styles, and nothing else of the page.
 */
import { Component, type ReactNode, StrictMode, useLayoutEffect, useRef } from "react";
import { createRoot } from "react-dom/client";
import { pageLink } from "../../api/page-link";
import { isStopKey } from "../../ui/keys";
import { useWatched } from "../../ui/watched";
import { StopButton } from "./stop-button";
import { StopNotice } from "./stop-notice";
import style from "./stop-root.module.css";
import { changedFromOutside, drawnStop, pageError } from "./stop-surroundings";

function Layer({ name, children }: { name: string | undefined; children: ReactNode }) {
  const layer = useRef<HTMLDivElement>(null);
  useLayoutEffect(
    () => (layer.current === null ? undefined : followVisualViewport(layer.current)),
    [],
  );
  return (
    <div ref={layer} className={`${style.layer} ${name}`}>
      {children}
    </div>
  );
}

const AGAIN = 1_000; // ms until what could not be drawn is tried again

/** Contains a fault of the notices: STOP can be pressed all the same. */
class Guard extends Component<{ children: ReactNode }, { failed: boolean }> {
  override state = { failed: false };
  #timer: ReturnType<typeof setTimeout> | undefined;

  static getDerivedStateFromError(): { failed: boolean } {
    return { failed: true };
  }

  override componentDidCatch(): void {
    clearTimeout(this.#timer);
    this.#timer = setTimeout(() => this.setState({ failed: false }), AGAIN);
  }

  override componentWillUnmount(): void {
    clearTimeout(this.#timer);
  }

  override render(): ReactNode {
    return this.state.failed ? null : this.props.children;
  }
}

function Reload() {
  return (
    <button type="button" className={style.reload} onClick={() => location.reload()}>
      Reload the page
    </button>
  );
}

/** In place of a page that an error took away. */
function BrokenPage({ error, stops }: { error: string; stops: boolean }) {
  return (
    <div className={style.panel} role="alert">
      <h1>This page broke</h1>
      <p>
        {stops
          ? "STOP still works, here and by its key (Ctrl .). What was shown as saved is saved."
          : "Nothing can be stopped from here: use the hardware stop."}
      </p>
      <code>{error}</code>
      <Reload />
    </div>
  );
}

function ChangedPage() {
  return (
    <div className={style.changed} role="alert">
      <span>
        A translation or an extension changes this page: what it says may be old or wrong. STOP
        works. Turn the translation or the extension off for this page, then reload.
      </span>
      <Reload />
    </div>
  );
}

function Stop() {
  const { signedIn } = useWatched(pageLink);
  const error = useWatched(pageError);
  const changed = useWatched(changedFromOutside);
  return (
    <>
      {error !== "" && (
        <Layer name={style.broken}>
          <BrokenPage error={error} stops={signedIn} />
        </Layer>
      )}
      {signedIn && (
        <Layer name={error === "" ? style.notices : style.broken}>
          <Guard>
            <StopNotice />
          </Guard>
          {changed && error === "" && <ChangedPage />}
        </Layer>
      )}
      {signedIn && (
        <Layer name={style.stop}>
          <StopButton />
        </Layer>
      )}
    </>
  );
}

/** Also while somebody types, in dialogs and menus: nothing is asked before a Stop. */
function onKey(event: KeyboardEvent): void {
  if (!isStopKey(event) || event.repeat) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  pageLink.now().live?.stop("all");
}

const SOON = 50; // ms: React may be in the middle of what failed
const OFTEN = 5; // times drawn anew, after which it is done each second only

/** Draw STOP into `place`, anew whenever an error or another script takes it away. */
function draw(place: HTMLElement, times = 0): void {
  const shell = document.createElement("div");
  place.replaceChildren(shell);
  let over = false;
  const again = (error: unknown) => {
    if (over) return;
    over = true;
    watch.disconnect();
    console.error("STOP is drawn anew:", error);
    const redraw = () => {
      root.unmount();
      draw(place, times + 1);
    };
    setTimeout(redraw, times < OFTEN ? SOON : AGAIN);
  };
  const root = createRoot(shell, { onUncaughtError: again });
  const watch = new MutationObserver((records) => {
    if (!place.isConnected) document.body.append(place);
    const stop = drawnStop.now();
    // Of what the button consists React only changes the letters.
    const emptied = records.some(
      ({ target, removedNodes }) => removedNodes.length > 0 && stop?.contains(target),
    );
    if (!shell.isConnected || stop?.isConnected === false || emptied) {
      again("another script changed it");
    }
  });
  watch.observe(document.documentElement, { childList: true, subtree: true });
  root.render(
    <StrictMode>
      <Stop />
    </StrictMode>,
  );
}

/** Begin with STOP: the page around it may come later, or never. */
export function mountStop(place: HTMLElement): void {
  window.addEventListener("keydown", onKey, { capture: true });
  draw(place);
}

const SIZES = ["transform", "width", "height"] as const;

/**
 * Lay `layer`, which is fixed at the upper left, over the visual viewport, at the size that it has
 * without zoom. Return what ends that.
 */
function followVisualViewport(layer: HTMLElement): () => void {
  const seen = window.visualViewport;
  if (seen == null) return () => {};
  const place = () => {
    const { offsetLeft, offsetTop, width, height, scale } = seen;
    const whole =
      scale === 1 && width === window.innerWidth && height === window.innerHeight && !offsetTop;
    if (whole) for (const name of SIZES) layer.style.removeProperty(name);
    else {
      layer.style.transform = `translate(${offsetLeft}px, ${offsetTop}px) scale(${1 / scale})`;
      layer.style.width = `${width * scale}px`;
      layer.style.height = `${height * scale}px`;
    }
  };
  place();
  const on = [
    [seen, "resize"],
    [seen, "scroll"],
    [window, "resize"],
  ] as const;
  for (const [target, name] of on) target.addEventListener(name, place);
  return () => {
    for (const [target, name] of on) target.removeEventListener(name, place);
  };
}
