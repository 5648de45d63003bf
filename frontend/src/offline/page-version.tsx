/** Detects that the server has another version of the page than this one, and says so. */
import { Button, CloseButton } from "@mantine/core";
import { useEffect, useState } from "react";
import { serverPath } from "../api/page-url";
import style from "./new-version-notice.module.css";

const BUILD = /<meta name="build" content="([^"]*)"/;
const AGAIN = 10 * 60_000; // ms between two looks

/** "" where the page was not built, as under `npm run dev`. */
function ownVersion(): string {
  return document.querySelector<HTMLMetaElement>('meta[name="build"]')?.content ?? "";
}

/** The version in a page as the server sends it; "" when it names none. */
export function versionIn(page: string): string {
  return BUILD.exec(page)?.[1] ?? "";
}

/** Null when no server says it. */
async function servedVersion(): Promise<string | null> {
  try {
    const headers = { accept: "text/html" };
    const answer = await fetch(serverPath("/"), { cache: "no-cache", headers });
    return answer.ok ? versionIn(await answer.text()) : null;
  } catch {
    return null;
  }
}

/** Calls back once, when the server has another version than the one that is shown. */
function watchVersion(onOther: () => void): () => void {
  const own = ownVersion();
  if (own === "") return () => {};
  const look = async () => {
    if (document.visibilityState !== "visible") return;
    const served = await servedVersion();
    if (served === null || served === "" || served === own) return;
    stop();
    onOther();
  };
  const listen = () => void look();
  const timer = setInterval(listen, AGAIN);
  document.addEventListener("visibilitychange", listen);
  window.addEventListener("online", listen);
  window.addEventListener("vite:preloadError", listen);
  const stop = () => {
    clearInterval(timer);
    document.removeEventListener("visibilitychange", listen);
    window.removeEventListener("online", listen);
    window.removeEventListener("vite:preloadError", listen);
  };
  return stop;
}

/** Has the browser keep the page for when no server answers. Only with TLS, or on this computer. */
export async function keepPage(): Promise<void> {
  if (ownVersion() === "" || !("serviceWorker" in navigator)) return;
  try {
    await navigator.serviceWorker.register(serverPath("/service-worker.js"), {
      scope: serverPath("/"),
    });
  } catch (error) {
    console.warn("This browser does not keep the page:", error);
  }
}

/** Says that the server has another version of the page, and offers to load it. */
export function NewVersionNotice() {
  const [shown, setShown] = useState(false);
  useEffect(() => watchVersion(() => setShown(true)), []);
  if (!shown) return null;
  return (
    <div className={style.notice} role="status">
      <span>The server was updated. This page still works; reload it to get the new version.</span>
      <Button size="compact-sm" onClick={() => location.reload()}>
        Reload
      </Button>
      <CloseButton aria-label="Not now" onClick={() => setShown(false)} />
    </div>
  );
}
