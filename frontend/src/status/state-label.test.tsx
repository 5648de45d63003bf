// @vitest-environment jsdom
import { act, useRef } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { useInStep } from "./state-label";

class Looping {
  startTime: number | null = 731;
}

let root: Root;

function Sign({ runs }: { runs: boolean }) {
  const element = useRef<HTMLElement>(null);
  useInStep(element, runs);
  return <i ref={element} />;
}

beforeEach(() => {
  vi.stubGlobal("CSSAnimation", Looping);
  root = createRoot(document.body.appendChild(document.createElement("div")));
});
afterEach(() => {
  act(() => root.unmount());
  document.body.replaceChildren();
  vi.unstubAllGlobals();
});

test("what begins to move takes the step of all that moves, and transitions keep theirs", () => {
  const [looping, transition] = [new Looping(), { startTime: 731 }];
  act(() => root.render(<Sign runs={false} />));
  const sign = document.querySelector("i");
  Reflect.set(sign ?? {}, "getAnimations", () => [looping, transition]);
  expect(looping.startTime).toBe(731);
  act(() => root.render(<Sign runs />));
  expect([looping.startTime, transition.startTime]).toEqual([0, 731]);
});
