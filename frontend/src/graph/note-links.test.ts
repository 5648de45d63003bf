import fc from "fast-check";
import { expect, test } from "vitest";
import type { Action } from "./model";
import {
  linkableNames,
  linkedAction,
  linkPieces,
  linkText,
  openLink,
  spokenNote,
  withLinkIds,
} from "./note-links";

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

test("renaming changes only links, and twice is the same as once, whatever is written", () => {
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

/** The text after taking a name where `|` stands; null where none is offered. */
function taken(marked: string, name: string): string | null {
  const caret = marked.indexOf("|");
  const text = marked.replace("|", "");
  const open = openLink(text, caret);
  if (open === null) return null;
  const link = linkText(text, caret, name);
  return text.slice(0, open.at) + link.text + text.slice(link.end);
}

test.each([
  ["go [[|", "go [[Drive 1]]"],
  ["go [[dri| then", "go [[Drive 1]] then"],
  ["go [[dri|]] then", "go [[Drive 1]] then"],
  ["go [[dri|] then", "go [[Drive 1]] then"],
  ["go [[Gr|ip 0#cccccccccccc]] then", "go [[Drive 1]] then"],
  ["[[Grip 0]] and [[|", "[[Grip 0]] and [[Drive 1]]"],
  ["[[x|\n[[Grip 0]]", "[[Drive 1]]\n[[Grip 0]]"],
  ["[[[|", "[[[Drive 1]]"],
  ["go [|", null],
  ["[[Grip 0]]|", null],
  ["[[Grip 0#ccc|cccccccc c]]", null],
  ["[[a\nb|", null],
  ["|[[", null],
  ["[|[", null],
])("a name taken in %j makes %j of it", (marked, wanted) => {
  expect(taken(marked, "Drive 1")).toBe(wanted);
});

test("names are offered that lead to one action each", () => {
  const odd = ["a[b", "c#d", " e", "f\ng", ""].map((name, i) => action(`x${i}`, name, 0));
  const twins = [action("y1", "Twin", 2), action("y2", "Twin", 2)];
  const gone = { ...action("z", "Gone", 0), missing: true };
  const all = [...ALL, ...odd, ...twins, gone];
  expect(linkableNames(all)).toEqual(["Drive 0", "Drive 1", "Grip 0"]);
  for (const name of linkableNames(all)) {
    expect(linkedAction(all, { name, id: "" })).not.toBeNull();
  }
});
