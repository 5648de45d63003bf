// @vitest-environment jsdom
import { MantineProvider } from "@mantine/core";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import { standInForBrowser } from "../testing/browser";
import { RenamedUses } from "./renamed-uses";

standInForBrowser();

const WHY = "Others have changed this 5 times; try again.";

test("where a name could not be changed in one graph, it is offered there again, with the reason", async () => {
  const answer = { changed: ["one"], refused: [{ graph: "two", why: WHY }] };
  vi.stubGlobal("fetch", async () => Response.json(answer));
  const onClose = vi.fn();
  const uses = [
    { id: "one", name: "Round" },
    { id: "two", name: "Patrol" },
  ];
  const root = createRoot(document.body.appendChild(document.createElement("div")));
  act(() =>
    root.render(
      <MantineProvider env="test">
        <RenamedUses graph="g" before="Lift" name="Raise" uses={uses} onClose={onClose} />
      </MantineProvider>,
    ),
  );
  const press = () =>
    [...document.querySelectorAll("button")].find((each) =>
      each.textContent?.includes("Change in"),
    );
  expect(press()?.textContent).toBe("Change in 2 graphs");
  await act(async () => press()?.click());
  const alert = () => document.querySelector("[role=alert]")?.textContent;
  await act(() => vi.waitFor(() => expect(alert()).toBe(`Patrol: ${WHY}`)));
  expect(press()?.textContent).toBe("Change in 1 graph");
  expect(onClose).not.toHaveBeenCalled();
  act(() => root.unmount());
});
