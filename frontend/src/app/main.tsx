/** Entry of the page around STOP, which has its own (`stop-main.ts`). */
import "@fontsource-variable/inter/index.css";
import "../ui/mantine.css";
import "../ui/base.css";
import "../ui/utilities.css";
// Of parts that both the home page and the editor begin with: two stylesheets less.
import "../status/state-label.module.css";
import "../ui/segments.module.css";
import { StrictMode } from "react";
import { createRoot } from "react-dom/client";
import { errorText } from "../api/http";
import { isViewPage } from "../api/page-url";
import { keepPage } from "../offline/page-version";
import { pageError } from "../runs/stop/stop-surroundings";
import { restAfterLostFields } from "../ui/focus-field";
import { App, ViewApp } from "./app";
import { preloadAt, preloadWhenIdle, ViewScreen } from "./screens";

// In a build each component brings it along (`vite.config.ts`).
if (import.meta.env.DEV) void import("../ui/mantine-more.css");

restAfterLostFields(() => void import("../ui/messages").then((part) => part.tellKeysRest()));
if (isViewPage) void ViewScreen.preload();
else void preloadAt(location.pathname).then(preloadWhenIdle).then(keepPage);

const root = document.getElementById("root");
if (root === null) throw new Error("index.html has no #root");
const onUncaughtError = (error: unknown) => {
  pageError.set(errorText(error) || "An error without words.");
  reportError(error);
};
createRoot(root, { onUncaughtError }).render(
  <StrictMode>{isViewPage ? <ViewApp /> : <App />}</StrictMode>,
);
