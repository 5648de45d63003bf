/** Entry of the page. */
import "@fontsource-variable/inter/index.css";
import "@fontsource-variable/jetbrains-mono/index.css";
import "@mantine/core/styles.css";
import "@mantine/notifications/styles.css";
import "../ui/tokens.css";
import "../ui/base.css";
import { StrictMode } from "react";
import { createRoot } from "react-dom/client";
import { keepPage } from "../offline/page-version";
import { App } from "./app";
import { preloadAt, preloadWhenIdle } from "./lazy-screens";

void preloadAt(location.pathname).then(preloadWhenIdle).then(keepPage);

const root = document.getElementById("root");
if (root === null) throw new Error("index.html has no #root");
createRoot(root).render(
  <StrictMode>
    <App />
  </StrictMode>,
);
