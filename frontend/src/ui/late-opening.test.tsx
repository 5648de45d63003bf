// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act, type ReactElement } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { standInForBrowser } from "../testing/browser";
import { LateOpening, useOpening } from "./late-opening";
import { lazyPart } from "./lazy-part";

standInForBrowser();

let root: Root;
let arrive: (missing?: Error) => void;

function Menu({ button }: { button: ReactElement }) {
  const [opened, open] = useOpening();
  return (
    <>
      {button}
      {opened && (
        <p>
          open
          <button type="button" onClick={() => open(false)}>
            Close
          </button>
        </p>
      )}
    </>
  );
}

const trigger = () => document.querySelector<HTMLElement>("[aria-label=More]");
const press = () => act(async () => trigger()?.click());

beforeEach(() => {
  vi.spyOn(console, "error").mockImplementation(() => {});
  const came = new Promise<void>((resolve, reject) => {
    arrive = (missing) => (missing ? reject(missing) : resolve());
  });
  const Part = lazyPart(() => came.then(() => Menu));
  root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider>
        <LateOpening opens="menu" part={(button) => <Part button={button} />}>
          <button type="button" aria-label="More" />
        </LateOpening>
      </MantineProvider>,
    ),
  );
});

afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.restoreAllMocks();
});

test("a menu that comes late opens by the press that asked for it, and its button has the focus", async () => {
  expect(trigger()?.getAttribute("aria-haspopup")).toBe("menu");
  await press();
  expect(document.activeElement).toBe(trigger());
  expect(document.body.textContent).not.toContain("open");
  await act(async () => arrive());
  await vi.waitFor(() => expect(document.body.textContent).toContain("open"));
  expect(document.activeElement).toBe(trigger());
});

test("a menu that does not come is said, and its button stays", async () => {
  await press();
  await act(async () => arrive(new Error("offline")));
  await vi.waitFor(() => expect(document.body.textContent).toContain("did not load"));
  expect(trigger()).not.toBeNull();
});
