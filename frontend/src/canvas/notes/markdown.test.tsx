import fc from "fast-check";
import { renderToStaticMarkup } from "react-dom/server";
import { expect, test } from "vitest";
import Markdown, { safeAddress } from "./markdown";
import { NoteLinksContext } from "./note-buttons";

const shown = (text: string) =>
  renderToStaticMarkup(
    <NoteLinksContext
      value={{
        target: ({ id, name }) => (id || name === "Grip 0" ? { key: id, label: "Grip 0" } : null),
        open: () => {},
        names: () => [],
      }}
    >
      <Markdown text={text} />
    </NoteLinksContext>,
  );

test("notes are Markdown that keeps line breaks", () => {
  expect(shown("**wait** for *light*\nthen `go`")).toContain(
    "<p><strong>wait</strong> for <em>light</em>\nthen <code>go</code></p>",
  );
  expect(shown("- a\n- b")).toMatch(/<ul><li>.*a.*<\/li><li>/s);
  expect(shown("# Head")).toContain('<p data-heading="1">Head</p>');
  expect(shown("    as it was")).toContain("<p>as it was</p>");
});

test("links lead to web and mail addresses only, and the opened page cannot access this one", () => {
  expect(shown("[a](https://x.test/y)")).toContain(
    '<a class="nodrag" href="https://x.test/y" target="_blank" rel="noopener noreferrer"',
  );
  expect(shown("see https://x.test/y.")).toContain('href="https://x.test/y"');
  expect(shown("<mailto:a@x.test>")).toContain('href="mailto:a@x.test"');
  for (const text of [
    "[a](javascript:alert(1))",
    "[a](<java\tscript:alert(1)>)",
    "[a](data:text/html,<script>1</script>)",
    "[a](file:///etc/passwd)",
    "[a](//x.test)",
    "<vbscript:x>",
    "[a][b]\n\n[b]: javascript:alert(1)",
  ]) {
    expect(shown(text)).not.toContain("<a ");
  }
});

test("links to actions show their current name; links without an action are text", () => {
  expect(shown("do [[Old 1#aaaaaaaaaaaa]]")).toMatch(/<button[^>]*>Grip 0<\/button>/);
  expect(shown("do [[Other 1]]")).toMatch(
    /<span class="[^"]*" title="No action.*">Other 1<\/span>/,
  );
  expect(shown("`[[Grip 0]]`")).not.toContain("<button");
});

/** Everything that may stand in a note's markup. */
const ALLOWED =
  /<\/?(?:div|p|strong|em|code|pre|br|hr|blockquote|ul|ol|li|a|button|span)(?: (?:class|data-heading|start|href|target|rel|title|type)="[^"<>]*")*\/?>/g;

test("any text is rendered as plain elements, never as a script", () => {
  const hostile = fc.constantFrom(
    "<img src=x onerror=alert(1)>",
    "<script>alert(1)</script>",
    "![a](http://x.test/a.png)",
    '[a](https://x.test "\\" onclick=alert(1)")',
    "[a](javascript&colon;alert(1))",
    "<svg/onload=1>",
    "&lt;b&gt;",
    "[[",
    "]]",
    "](",
    "> ",
    "\n",
    "*",
    "`",
    "https://x.test/<b>",
    "\u202e",
    "[[<i>]]",
  );
  fc.assert(
    fc.property(fc.array(fc.oneof(hostile, fc.string()), { maxLength: 12 }), (pieces) => {
      const html = shown(pieces.join(""));
      expect(html.replaceAll(ALLOWED, "")).not.toMatch(/[<>]/);
      for (const [, address] of html.matchAll(/href="([^"]*)"/g)) {
        expect(address).toMatch(/^(https?|mailto):/);
      }
    }),
  );
  expect(safeAddress("JaVaScRiPt:alert(1)")).toBeNull();
});

test.each(["> ", "*", "[", "![", "`", "- ", "<", "_a", "[[", "[a](", "&", "\\", "1. "])(
  "a note that is only %s is shown without delay",
  (piece) => {
    const html = shown(piece.repeat(5000 / piece.length));
    expect(html.length).toBeGreaterThan(0);
    expect(html.match(/<(?:blockquote|ol|ul)/g)?.length ?? 0).toBeLessThan(20);
  },
);
