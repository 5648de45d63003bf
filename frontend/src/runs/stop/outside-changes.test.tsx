// @vitest-environment jsdom
import { act } from "react";
import { createRoot, type Root } from "react-dom/client";
import { afterEach, beforeAll, beforeEach, expect, test, vi } from "vitest";
import { outliveOutsideChanges } from "./outside-changes";

const told = vi.fn();
let place: HTMLElement;
let root: Root;

beforeAll(() => {
  vi.stubGlobal("IS_REACT_ACT_ENVIRONMENT", true);
  outliveOutsideChanges(told);
});
beforeEach(() => {
  told.mockReset();
  place = document.createElement("div");
  document.body.append(place);
  root = createRoot(place);
});
afterEach(async () => {
  await act(async () => root.unmount());
  place.remove();
});

/** A state in words as the page has them: texts beside each other, of which some come and go. */
function State({ word, robot = "" }: { word: string; robot?: string }) {
  return (
    <p>
      Lift {word}
      {robot !== "" && <b>{robot}</b>} {robot === "" ? "nowhere" : "here"}
    </p>
  );
}

const draw = (word: string, robot?: string) =>
  act(async () => root.render(<State word={word} {...(robot === undefined ? {} : { robot })} />));

const texts = () => {
  const walk = document.createTreeWalker(place, NodeFilter.SHOW_TEXT);
  const all: Text[] = [];
  while (walk.nextNode()) all.push(walk.currentNode as Text);
  return all;
};

function font(inner: Node): HTMLElement {
  const [outer, middle] = [document.createElement("font"), document.createElement("font")];
  middle.append(inner);
  outer.append(middle);
  return outer;
}

/** Ways in which real translators replace a text. */
const TRANSLATORS: Readonly<Record<string, (text: Text) => void>> = {
  "wraps a text": (text) => {
    const at = document.createElement("i");
    text.before(at);
    at.replaceWith(font(text));
  },
  "replaces a text by another one": (text) => text.replaceWith(font(new Text("übersetzt"))),
  "puts another text before it and removes it": (text) => {
    text.before(font(new Text("übersetzt")));
    text.remove();
  },
};

test.each(Object.entries(TRANSLATORS))(
  "a translator that %s leaves no old word",
  async (_, translate) => {
    await draw("waits", "David");
    for (const text of texts()) translate(text);
    await Promise.resolve(); // as between the translator's task and the page's next one
    await draw("runs");
    expect(place.textContent).toBe("Lift runs nowhere");
    for (const text of texts()) translate(text);
    await Promise.resolve();
    await draw("ended", "Eve");
    expect(place.textContent).toBe("Lift endedEve here");
    expect(place.querySelector("font")).toBeNull();
    expect(told).not.toHaveBeenCalled();
  },
);

test("a node that an extension removes breaks nothing, and is told", async () => {
  await draw("waits", "David");
  place.querySelector("b")?.remove();
  await draw("runs");
  expect(place.textContent).toBe("Lift runs nowhere");
  expect(told).toHaveBeenCalled();
  place.querySelector("p")?.replaceChildren();
  await draw("ended", "Eve");
  await act(async () => root.render(<em>STOP</em>));
  expect(place.textContent).toBe("STOP");
});
