import fc from "fast-check";
import { expect, test } from "vitest";
import type { Action } from "./model";
import { linkedAction, linkPieces, spokenNote, withLinkIds } from "./note-links";

const action = (key: string, name: string, instanceId: number) =>
  ({ key, name, instanceId }) as Action;
const DRIVE = action("aaaaaaaaaaaa", "Drive", 0);
const AGAIN = action("bbbbbbbbbbbb", "Drive", 1);
const GRIP = action("cccccccccccc", "Grip", 0);
const ALL = [DRIVE, AGAIN, GRIP];

test("a link that was written by name keeps its action, whatever that is called later", () => {
  const text = withLinkIds("first [[Drive 1]], then [[Grip]].", ALL);
  expect(text).toBe("first [[Drive 1#bbbbbbbbbbbb]], then [[Grip 0#cccccccccccc]].");
  const renamed = [DRIVE, { ...AGAIN, name: "Go" }, GRIP];
  const link = linkPieces(text)[1];
  expect(typeof link === "object" && linkedAction(renamed, link)?.name).toBe("Go");
  expect(withLinkIds(text, renamed)).toContain("[[Go 1#bbbbbbbbbbbb]]");
  expect(spokenNote(text)).toBe("first [[Drive 1]], then [[Grip 0]].".replaceAll(/\[\[|\]\]/g, ""));
});

test("a name that several actions have leads nowhere, and stays as it was written", () => {
  expect(withLinkIds("[[Drive]] [[Nothing]] [[Drive 7]]", ALL)).toBe(
    "[[Drive]] [[Nothing]] [[Drive 7]]",
  );
  expect(linkedAction(ALL, { name: "Grip", id: "dddddddddddd" })).toBeNull();
});

test("whatever is written, nothing but links changes, and doing it twice is doing it once", () => {
  const piece = fc.constantFrom(
    "[[",
    "]]",
    "[",
    "]",
    "#",
    "Drive",
    " 0",
    "aaaaaaaaaaaa",
    "x",
    "\n",
  );
  fc.assert(
    fc.property(fc.array(piece, { maxLength: 30 }), (pieces) => {
      const text = pieces.join("");
      const once = withLinkIds(text, ALL);
      expect(withLinkIds(once, ALL)).toBe(once);
      const words = (all: string) => linkPieces(all).filter((each) => typeof each === "string");
      expect(words(once)).toEqual(words(text));
    }),
  );
});
