// @vitest-environment jsdom
import { ReactFlowProvider } from "@xyflow/react";
import { act } from "react";
import { createRoot } from "react-dom/client";
import { expect, test, vi } from "vitest";
import type { Position } from "../graph/model";
import { standInForBrowser } from "../testing/browser";
import { fromUmrf } from "./from-umrf";
import { GraphView } from "./graph-view";

standInForBrowser();

/** What a long press asks: whether there was a menu at its place. */
const { pressed } = vi.hoisted(() => ({ pressed: [] as ((screen: Position) => boolean)[] }));
vi.mock("./menu-press", async (original) => ({
  ...(await original<typeof import("./menu-press")>()),
  useMenuPress: (open: (screen: Position) => boolean) => {
    pressed.push(open);
    return {};
  },
}));
// jsdom has no places on the screen.
vi.mock("./hit-test", () => ({ nodeAt: () => "card", arrowAt: () => null }));

test("a long press on a card without a menu opens none, so that it counts as a click", () => {
  const graph = fromUmrf({ graph_name: "g", actions: [{ name: "Work", instance_id: 0 }] });
  const root = createRoot(document.createElement("div"));
  const menus = vi.fn<(id: string, screen: Position) => boolean>();
  act(() =>
    root.render(
      <ReactFlowProvider>
        <GraphView graph={graph} progress={new Map()} label="g" onMenu={menus} />
      </ReactFlowProvider>,
    ),
  );
  const press = pressed.at(-1);
  menus.mockReturnValueOnce(false).mockReturnValueOnce(true);
  expect([press?.([1, 2]), press?.([1, 2])]).toEqual([false, true]);
  expect(menus).toHaveBeenCalledWith("card", [1, 2]);
  act(() => root.unmount());
});
