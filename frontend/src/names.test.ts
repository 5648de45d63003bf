/** Names within sentences are isolated, wherever the page has a sentence: found in the syntax of all modules. */
import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import ts from "typescript";
import { expect, test } from "vitest";

const SRC = import.meta.dirname;
const modules = readdirSync(SRC, { recursive: true, encoding: "utf8" })
  .map((file) => file.replaceAll("\\", "/"))
  .filter((file) => /\.tsx?$/.test(file) && !/\.test\.tsx?$|\.d\.ts$/.test(file))
  .filter((file) => !file.startsWith("testing/") && file !== "words/isolated.ts");

/** What code calls the name of something that a person has named. */
const NAMED =
  /^(action|sender|name|who|by|child|parent|label|robot|engine|person|author|graph|called|nameOf|[a-z]+_name|(?!class|version|unit|code|tag|file|type|short|folder|field|member|command)[a-z]\w*Name)$/;
/** Attributes that nobody reads. */
const UNREAD = /^(key|id|className|to|href|d|value|data-.*|htmlFor|name|download)$/;
/** Where what looks like a bare name in a sentence is none, and why. */
const NO_SENTENCES: Readonly<Record<string, string>> = {
  "administration/process-card.tsx": "folders of the server, which nobody names in the page",
  "api/http.ts": "one of two processes",
  "courses/keep-dry-run.tsx": "the name of a new course, which is isolated where it stands",
  "courses/untaken-list.tsx": "the name of a new course, which is isolated where it stands",
  "edit-actions/edit-action.ts": "commands of the page",
  "editor/menus/shortcut-sheet.tsx": "commands of the page",
  "editor/stranded-edits.tsx": "the name of a file",
  "inspector/json/json-positions.ts": "JSON",
  "home/graph-menu.tsx": "the name of a new graph, which is isolated where it stands",
  "review/run-facts.tsx": "words with a name that is isolated in them",
  "review/run-menu.tsx": "the name of a new course, which is isolated where it stands",
  "runs/stop/stop-notice.tsx": "words with a name that is isolated in them",
  "ui/hold-button.tsx": "words of the page",
};

/** Return how an expression calls what it gives, or "" where it is no name. */
function calledIn(node: ts.Expression): string {
  if (ts.isIdentifier(node)) return node.text;
  if (ts.isPropertyAccessExpression(node)) return node.name.text;
  if (ts.isBinaryExpression(node)) return calledIn(node.left); // name || "Untitled"
  if (
    ts.isCallExpression(node) ||
    ts.isNonNullExpression(node) ||
    ts.isParenthesizedExpression(node)
  )
    return calledIn(node.expression);
  return "";
}

const isSentence = (text: string): boolean =>
  /\p{L}{2,}|[→“”:,]/u.test(text) && /\s|“/.test(text) && !/[/<>=|~]\S|__|&/.test(text);

function isUnread(node: ts.Node): boolean {
  for (let at = node; !ts.isBlock(at) && !ts.isSourceFile(at); at = at.parent) {
    if (ts.isJsxAttribute(at)) return UNREAD.test(at.name.getText());
    if (ts.isPropertyAssignment(at) && /^(id|key|to)$/.test(at.name.getText())) return true;
    if (ts.isNewExpression(at)) return true;
  }
  return false;
}

/** Return the names that stand in a sentence with nothing around them: in a template, or between words. */
function bareNames(file: string, text: string): string[] {
  const source = ts.createSourceFile(file, text, ts.ScriptTarget.Latest, true);
  const found: ts.Expression[] = [];
  const visit = (node: ts.Node): void => {
    if (ts.isTemplateExpression(node)) {
      const fixed = [node.head, ...node.templateSpans.map((span) => span.literal)];
      if (isSentence(fixed.map((each) => each.text).join("\0")) && !isUnread(node))
        found.push(...node.templateSpans.map((span) => span.expression));
    } else if (ts.isJsxElement(node) || ts.isJsxFragment(node)) {
      const isName = ts.isJsxElement(node) && node.openingElement.tagName.getText() === "bdi";
      const says = (each: ts.Node) => ts.isJsxText(each) && /\p{L}|[→:,“”]/u.test(each.text);
      if (!isName && node.children.some(says))
        for (const each of node.children)
          if (ts.isJsxExpression(each) && each.expression) found.push(each.expression);
    }
    ts.forEachChild(node, visit);
  };
  visit(source);
  return found.filter((each) => NAMED.test(calledIn(each))).map((each) => each.getText());
}

test("a name in a sentence is isolated: its letters may turn the words around it", () => {
  const bare = modules.flatMap((file) =>
    bareNames(file, readFileSync(join(SRC, file), "utf8")).map((name) => [file, name] as const),
  );
  expect(bare.filter(([file]) => !(file in NO_SENTENCES))).toEqual([]);
  const files = new Set(bare.map(([file]) => file));
  expect(Object.keys(NO_SENTENCES).filter((file) => !files.has(file))).toEqual([]);
});

test("a bare name is found in a template, an attribute and between words, and nowhere else", () => {
  const found = (code: string) => bareNames("x.tsx", code.replaceAll("§", "$"));
  expect(found("say(`§{who} changed it`)")).toEqual(["who"]);
  expect(found("<a title={`Open §{action.name || 'it'}`} />")).toHaveLength(1);
  expect(found("<p>Nothing of {nameOf(graph)} runs.</p>")).toEqual(["nameOf(graph)"]);
  expect(found("<p>Nothing of <bdi>{name}</bdi> or {isolated(name)} runs.</p>")).toEqual([]);
  expect(found("<a key={`§{name}: x`} to={`/graphs/§{graph}`}>{name}</a>")).toEqual([]);
});
