/** Check the structure of the page: layers without import circles, and functions of a readable size. */
import { readdirSync, readFileSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";
import ts from "typescript";
import { expect, test } from "vitest";

const SRC = import.meta.dirname;

const files = readdirSync(SRC, { recursive: true, encoding: "utf8" })
  .filter((file) => /\.tsx?$/.test(file) && !file.endsWith(".d.ts"))
  .map((file) => file.replaceAll("\\", "/"))
  .sort();
const isTest = (file: string) => /\.test\.tsx?$/.test(file);
const modules = files.filter((file) => !isTest(file));
const known = new Set(files);
const textOf = (file: string) => readFileSync(join(SRC, file), "utf8");
const folderOf = (file: string) => dirname(file);
const topOf = (file: string) => file.split("/")[0] ?? "";

/** The modules that a module imports, types included. */
function importsOf(file: string): string[] {
  const found: string[] = [];
  for (const [, path = ""] of textOf(file).matchAll(/\b(?:from|import)\s*\(?\s*"(\.[^"]*)"/g)) {
    const base = relative(SRC, resolve(SRC, dirname(file), path)).replaceAll("\\", "/");
    const target = [".ts", ".tsx", "/index.ts"].map((end) => base + end).find((f) => known.has(f));
    if (target !== undefined) found.push(target);
    else if (!/\.(css|json)$/.test(path))
      throw new Error(`${file} imports ${path}, which is not there`);
  }
  return found;
}
const imports = new Map(files.map((file) => [file, importsOf(file)]));

const BELOW_EDITOR = [
  "clock",
  "words",
  "graph",
  "ui",
  "api",
  "status",
  "canvas",
  "sync",
  "dry-run",
  "edit-actions",
];
/** What each folder may import besides itself: what stands above it here, as far as it needs that. */
const LAYERS: Readonly<Record<string, readonly string[]>> = {
  clock: [],
  words: [],
  graph: ["words"],
  ui: ["clock", "words"],
  api: ["clock", "words", "graph"],
  offline: ["api"],
  status: ["clock", "words", "graph", "ui", "api"],
  canvas: ["clock", "words", "graph", "ui", "api", "status"],
  sync: ["clock", "words", "graph", "api"],
  "dry-run": ["words", "graph", "api", "status"],
  "edit-actions": ["words", "graph", "ui", "api", "canvas", "dry-run"],
  differences: ["words", "graph", "ui", "api"],
  people: BELOW_EDITOR,
  comments: BELOW_EDITOR,
  find: BELOW_EDITOR,
  outline: BELOW_EDITOR,
  packages: BELOW_EDITOR,
  courses: BELOW_EDITOR,
  levels: BELOW_EDITOR,
  history: [...BELOW_EDITOR, "differences", "courses"],
  drafts: [...BELOW_EDITOR, "courses", "history"],
  inspector: [...BELOW_EDITOR, "people", "comments", "courses"],
  editor: [...BELOW_EDITOR, "people", "comments", "find", "outline", "inspector"].concat([
    "packages",
    "courses",
    "history",
    "drafts",
    "levels",
  ]),
  // Features of their own know neither the editor nor each other.
  runs: ["clock", "words", "graph", "ui", "api", "status", "canvas"],
  review: ["clock", "words", "graph", "ui", "api", "status", "canvas", "differences"],
  robots: ["clock", "words", "ui", "api", "status"],
  home: ["words", "graph", "ui", "api", "status", "canvas"],
  // The page of the library is an editor of its own, with the same forms and rooms.
  library: [...BELOW_EDITOR, "people", "comments", "differences", "history"].concat([
    "inspector",
    "packages",
    "editor",
    "home",
  ]),
  account: ["clock", "words", "ui", "api"],
  administration: ["clock", "words", "ui", "api", "status"],
  programs: ["words", "ui", "api"],
  view: ["clock", "words", "graph", "ui", "api", "status", "canvas"],
  app: [
    "clock",
    "words",
    "graph",
    "ui",
    "api",
    "status",
    "offline",
    "canvas",
    "sync",
    "dry-run",
    "editor",
  ].concat([
    "runs",
    "review",
    "robots",
    "home",
    "library",
    "account",
    "administration",
    "programs",
    "view",
  ]),
};

test("folders import only what lies below them", () => {
  const wrong: string[] = [];
  for (const file of modules.filter((module) => topOf(module) !== "testing")) {
    const allowed = LAYERS[topOf(file)];
    if (allowed === undefined) wrong.push(`${topOf(file)} is in no layer`);
    for (const target of imports.get(file) ?? []) {
      const top = topOf(target);
      if (top !== topOf(file) && !allowed?.includes(top)) wrong.push(`${file} imports ${target}`);
    }
  }
  expect(wrong).toEqual([]);
});

test("layers stand in their order, so that no two folders need each other", () => {
  const order = Object.keys(LAYERS);
  const wrong = Object.entries(LAYERS).flatMap(([folder, allowed]) =>
    allowed.filter((other) => order.indexOf(other) >= order.indexOf(folder)),
  );
  expect(wrong).toEqual([]);
});

test("no folders import each other in a circle, folders in folders neither", () => {
  const edges = new Map<string, Set<string>>();
  for (const file of modules) {
    for (const target of imports.get(file) ?? []) {
      const [from, to] = [folderOf(file), folderOf(target)];
      if (from !== to) edges.set(from, (edges.get(from) ?? new Set()).add(to));
    }
  }
  const reaches = (from: string, goal: string, seen = new Set<string>()): boolean =>
    [...(edges.get(from) ?? [])].some((next) => {
      if (next === goal) return true;
      if (seen.has(next)) return false;
      seen.add(next);
      return reaches(next, goal, seen);
    });
  expect([...edges.keys()].filter((folder) => reaches(folder, folder))).toEqual([]);
});

test("no files import each other in a circle, not even for a type", () => {
  const isInCircle = (file: string): boolean => {
    const seen = new Set<string>();
    const next = [...(imports.get(file) ?? [])];
    for (let at = next.pop(); at !== undefined; at = next.pop()) {
      if (at === file) return true;
      if (seen.has(at)) continue;
      seen.add(at);
      next.push(...(imports.get(at) ?? []));
    }
    return false;
  };
  expect(modules.filter(isInCircle)).toEqual([]);
});

test("what only tests need is imported by tests only", () => {
  const wrong = modules.filter(
    (file) =>
      topOf(file) !== "testing" && (imports.get(file) ?? []).some((t) => topOf(t) === "testing"),
  );
  expect(wrong).toEqual([]);
});

/** Who may ask the browser for the time beside the clock, and why. */
const OWN_TIME: Readonly<Record<string, string>> = {
  "graph/edit/undo-history.ts":
    "joins changes within half a second, and graph/ knows nothing of servers",
};

test("only the clock asks the browser for the time: everything else would be by one that may be hours off", () => {
  const asks =
    /\bDate\.now\b|\bnew Date\(\)|\bDate\(\)|\bperformance\.(now|timeOrigin)\b|\.(data|error)UpdatedAt\b/;
  const found = modules.filter((file) => topOf(file) !== "testing" && asks.test(textOf(file)));
  const others = found.filter((file) => file !== "clock/server-clock.ts" && !(file in OWN_TIME));
  expect(others).toEqual([]);
  expect(Object.keys(OWN_TIME).filter((file) => !found.includes(file))).toEqual([]);
});

test("nothing is put where the browser lets nobody press STOP: above every layer, or as the whole screen", () => {
  const above = /\.(showModal|showPopover|requestFullscreen)\(|\bpopover=/;
  expect(modules.filter((file) => above.test(textOf(file)))).toEqual([]);
});

test("browser tests wait for events, not for a time", () => {
  const specs = readdirSync(join(SRC, "../e2e")).filter((file) => file.endsWith(".ts"));
  const waits = specs.filter((file) => textOf(`../e2e/${file}`).includes(".waitForTimeout("));
  expect(waits).toEqual([]);
});

/** An alarm, not a limit to split by: a function with more statements needs a reason. */
const MOST_STATEMENTS = 60;
const MOST_STATEMENTS_OF_A_STORY = 90; // a test in a browser: what people do, step after step
/** Functions that have more, and why. */
const LONG_FUNCTIONS: Readonly<Record<string, string>> = {};

const nameOf = (node: ts.Node): string => {
  if (ts.isFunctionLike(node) && node.name !== undefined) return node.name.getText();
  if (ts.isVariableDeclaration(node.parent)) return node.parent.name.getText();
  return ts.isCallExpression(node.parent) ? node.parent.expression.getText() : "";
};

/** Return every function of a file with its number of statements; functions inside do not count. */
function statementsOf(file: string): [string, number][] {
  const source = ts.createSourceFile(file, textOf(file), ts.ScriptTarget.Latest, true);
  const found: [string, number][] = [];
  const visit = (node: ts.Node): number => {
    let count = ts.isStatement(node) && !ts.isBlock(node) ? 1 : 0;
    ts.forEachChild(node, (child) => {
      count += visit(child);
    });
    if (!ts.isFunctionLike(node) || !("body" in node) || node.body === undefined) return count;
    found.push([`${file} ${nameOf(node)}`, count]);
    return 0;
  };
  visit(source);
  return found;
}

test("functions are short", { timeout: 60_000 }, () => {
  const specs = readdirSync(join(SRC, "../e2e")).filter((file) => file.endsWith(".ts"));
  const long = [...files, ...specs.map((file) => `../e2e/${file}`)].flatMap((file) =>
    statementsOf(file).filter(
      ([, count]) =>
        count > (file.endsWith(".spec.ts") ? MOST_STATEMENTS_OF_A_STORY : MOST_STATEMENTS),
    ),
  );
  expect(long.filter(([name]) => !(name in LONG_FUNCTIONS))).toEqual([]);
  const names = new Set(long.map(([name]) => name));
  expect(Object.keys(LONG_FUNCTIONS).filter((name) => !names.has(name))).toEqual([]);
});

/** What tells which key was pressed; `ui/keys.ts` alone reads it. */
const KEY_MEMBERS = new Set(["key", "code", "keyCode", "which", "charCode"]);
const ONLY_OF_KEYS = new Set(["isComposing", "keyCode", "charCode"]);
const KEY_EVENTS = new Set(["keydown", "keyup", "keypress"]);

/** Whether a function is given as a handler of keys, or something that holds it says so in its type. */
function handlesKeys(node: ts.SignatureDeclaration): boolean {
  for (let at: ts.Node = node; at.parent !== undefined; at = at.parent) {
    const { parent } = at;
    if (ts.isJsxAttribute(parent)) return parent.name.getText().startsWith("onKey");
    if (ts.isPropertyAssignment(parent)) return parent.name.getText().startsWith("onKey");
    if (ts.isCallExpression(parent)) {
      const [kind] = parent.arguments;
      return kind !== undefined && ts.isStringLiteral(kind) && KEY_EVENTS.has(kind.text);
    }
    if (ts.isVariableDeclaration(parent)) return /Keyboard/.test(parent.type?.getText() ?? "");
    if (ts.isBinaryExpression(parent)) {
      const holder = parent.left.getText().replace(/\.current$/, "");
      const line = new RegExp(`\\b${holder}\\b.*`).exec(node.getSourceFile().text)?.[0] ?? "";
      return /Keyboard/.test(line);
    }
    if (ts.isStatement(parent)) return false;
  }
  return false;
}

const isKeyEvent = (parameter: ts.ParameterDeclaration): boolean => {
  const type = parameter.type?.getText() ?? "";
  if (/Keyboard|KeyPress|\bPressed\b/.test(type)) return true;
  return parameter.parent.parameters[0] === parameter && handlesKeys(parameter.parent);
};

/** Return where a file reads by itself which key was pressed, or whether an input method composes. */
function keyReadings(file: string, text = textOf(file)): string[] {
  if (!/Keyboard|KeyPress|Pressed|\bonKey|"key(?:down|up|press)"|\bevent\.key\b/.test(text))
    return [];
  const source = ts.createSourceFile(file, text, ts.ScriptTarget.Latest, true);
  const found: string[] = [];
  const report = (node: ts.Node) => {
    const { line } = source.getLineAndCharacterOfPosition(node.getStart());
    found.push(`${file}:${line + 1} ${node.getText()}`);
  };
  const visit = (node: ts.Node, events: ReadonlySet<string>): void => {
    let known = events;
    if (ts.isFunctionLike(node)) {
      const own = node.parameters.filter(isKeyEvent);
      for (const { name } of own.filter((each) => ts.isObjectBindingPattern(each.name))) {
        for (const each of (name as ts.ObjectBindingPattern).elements)
          if (KEY_MEMBERS.has((each.propertyName ?? each.name).getText())) report(each);
      }
      known = new Set([...events, ...own.map(({ name }) => name.getText())]);
    }
    if (ts.isPropertyAccessExpression(node)) {
      const [whose, member] = [node.expression.getText(), node.name.text];
      const named = member === "key" && /^(?:event|evt|ev|e)$/.test(whose);
      const ofEvent = named || known.has(whose.replace(/\.nativeEvent$/, ""));
      if (ONLY_OF_KEYS.has(member) || (ofEvent && KEY_MEMBERS.has(member))) report(node);
    }
    if (
      ts.isVariableDeclaration(node) &&
      ts.isObjectBindingPattern(node.name) &&
      known.has(node.initializer?.getText() ?? "")
    ) {
      for (const each of node.name.elements)
        if (KEY_MEMBERS.has((each.propertyName ?? each.name).getText())) report(each);
    }
    ts.forEachChild(node, (child) => visit(child, known));
  };
  visit(source, new Set());
  return found;
}

test("only ui/keys.ts reads which key was pressed, for every layout and input method", () => {
  expect(modules.filter((file) => file !== "ui/keys.ts").flatMap((f) => keyReadings(f))).toEqual(
    [],
  );
});

test.each([
  'window.addEventListener("keydown", (press) => press.key === "z");',
  'window.addEventListener("keydown", ({ key }) => key === "z");',
  "const f = (press: React.KeyboardEvent) => press.code;",
  "const f = (press: KeyboardEvent) => { const { key } = press; };",
  "const f: React.KeyboardEventHandler = (press) => press.key;",
  "const f = (event: { key: string }) => event.key;",
  "const f = useRef<(event: KeyboardEvent) => boolean>(none);\nf.current = ({ key }) => key;",
  'const a = <input onKeyDown={(press) => press.key === "Enter"} />;',
  "const a = <input onKeyDown={(press) => press.nativeEvent.isComposing} />;",
  "const a = { onKeyUp: (press) => press.which };",
])("a handler that reads keys by itself is found: %s", (text) => {
  expect(keyReadings("handler.tsx", text)).toHaveLength(1);
});

const TEXT_FIELDS = new Set(
  ["TextInput", "Textarea", "textarea", "input", "Autocomplete", "NumberInput"].concat([
    "TagsInput",
    "PasswordInput",
    "ColorInput",
    "JsonInput",
  ]),
);
const NO_TEXT = /\btype="(?:radio|checkbox|range|file|date)"/;
const DRAFT_HOOKS = /\buse(?:Draft|PendingText|KeptText)\(/;

/** Text fields without a draft, and why nothing that is typed there looks saved and gets lost. */
const DIALOG = "a dialog that asks for little: its button says whether it is done";
const UNDRAFTED: Readonly<Record<string, string>> = {
  "account/account-panel.tsx AccountPanel": DIALOG,
  "account/sign-in.tsx Invitation": "a form of its own: its button lets its person in",
  "account/name-prompt.tsx NamePrompt": DIALOG,
  "account/share-dialog.tsx NewLink": DIALOG,
  "account/view-links.tsx ViewLinks": DIALOG,
  "account/view-links.tsx LinkToCopy": "read only: a link to copy",
  "account/sign-in.tsx SignInBar": "a secret: never kept",
  "account/sign-in.tsx SignIn": "a secret: never kept",
  "library/action-list.tsx ActionList": "a search",
  "account/people-page.tsx FreshLink": "read only: a link to copy",
  "library/actions-page.tsx NewActionForm": DIALOG,
  "administration/audit-page.tsx Filters": "a filter",
  "courses/keep-dry-run.tsx NameField": DIALOG,
  "drafts/drafts-here.tsx NewDraftDialog": DIALOG,
  "editor/canvas/quick-add.tsx QuickAdd": "a search: what it finds is added at once",
  "find/find-bar.tsx FindBar": "a search",
  "levels/sub-graph-dialogs.tsx ExtractForm": DIALOG,
  "levels/flat-dialog.tsx FlatForm": DIALOG,
  "home/graph-list.tsx Tools": "a search",
  "home/folder-dialogs.tsx FolderName": DIALOG,
  "home/folder-dialogs.tsx MoveChoice": DIALOG,
  "home/rename-dialog.tsx Rename": DIALOG,
  "home/sidebar.tsx Sidebar": "a search",
  "programs/login-card.tsx LoginCard": "a code that is valid for minutes",
  "programs/login-card.tsx Question": "a form of its own: its button lets the program in",
  "programs/programs-page.tsx NewToken": "a form of its own: its button makes the token",
  "programs/programs-page.tsx Secret": "read only: a token to copy",
  "review/run-filters.tsx Person": "a filter",
  "review/run-filters.tsx RunFilters": "a filter",
  "review/run-events.tsx RunEvents": "a filter",
  "review/incident-dialog.tsx IncidentDialog": DIALOG,
  "review/run-menu.tsx ExpectDialog": DIALOG,
  "robots/health-fields.tsx CheckFields":
    "a part of HealthFields, which holds all checks as a draft",
  "robots/robot-form.tsx Profile": "a part of RobotForm, which holds all of the robot as a draft",
  "robots/robot-form.tsx Reach": "a part of RobotForm, which holds all of the robot as a draft",
  "runs/start/start-dialog.tsx Choice": "no text: a robot that is ticked",
  "status/start-values-form.tsx Input":
    "values of a start: its dialog says which are sent, and the next one begins with these",
  "ui/pick-list.tsx PickList": "a search",
  "ui/typed-ahead.tsx TypingField": "keys for the field of a part that is loading",
};

/** Return the functions of a file that draw a text field and hold no draft. */
function undrafted(file: string, text = textOf(file)): string[] {
  if (!/<(?:[A-Z]\w*|textarea|input)\b/.test(text)) return [];
  const source = ts.createSourceFile(file, text, ts.ScriptTarget.Latest, true);
  const found = new Set<string>();
  const visit = (node: ts.Node, outer: ts.Node | null): void => {
    const isField =
      (ts.isJsxOpeningElement(node) || ts.isJsxSelfClosingElement(node)) &&
      TEXT_FIELDS.has(node.tagName.getText()) &&
      !NO_TEXT.test(node.attributes.getText());
    if (isField && !DRAFT_HOOKS.test(outer?.getText() ?? ""))
      found.add(`${file} ${outer === null ? "" : nameOf(outer)}`);
    const around = outer ?? (ts.isFunctionLike(node) ? node : null);
    ts.forEachChild(node, (child) => visit(child, around));
  };
  visit(source, null);
  return [...found];
}

test("what is typed in a field is a draft until it is written, or the reason is named", () => {
  const found = modules.flatMap((file) => undrafted(file));
  expect(found.filter((field) => !(field in UNDRAFTED))).toEqual([]);
  expect(Object.keys(UNDRAFTED).filter((field) => !found.includes(field))).toEqual([]);
});

test("what takes several lines to type is always a draft", () => {
  const dialogs = Object.keys(UNDRAFTED).filter((field) => UNDRAFTED[field] === DIALOG);
  const files = dialogs.map((field) => field.split(" ")[0] ?? "");
  const several = files.filter((file) => /<(?:Textarea|textarea|JsonInput)\b/.test(textOf(file)));
  expect(several).toEqual([]);
});

test("a text field that writes after a pause by itself is found", () => {
  const field = `export function Name() {
    const [text, setText] = useState("");
    useEffect(() => { const t = setTimeout(() => write(text), 700); return () => clearTimeout(t); });
    return <TextInput value={text} onChange={(event) => setText(event.currentTarget.value)} />;
  }`;
  expect(undrafted("name.tsx", field)).toEqual(["name.tsx Name"]);
  expect(undrafted("name.tsx", field.replace("useEffect(", "useDraft("))).toEqual([]);
});
