import fc from "fast-check";
import { expect, test } from "vitest";
import { isComposing, isStopKey, type KeyPress, keyOf, keysOf, typedCharacter } from "./keys";

const ctrl = { ctrlKey: true, metaKey: false };

/** Characters that keys type on layouts of other scripts, by the place of the key. */
const LAYOUTS: Readonly<Record<string, Readonly<Record<string, string>>>> = {
  Russian: { KeyZ: "я", KeyC: "с", KeyN: "т", Period: "ю", BracketLeft: "х", BracketRight: "ъ" },
  Greek: { KeyZ: "ζ", KeyC: "ψ", KeyN: "ν" },
  Arabic: { KeyZ: "ئ", KeyC: "ؤ", KeyN: "ى", KeyB: "لا", Period: "ز", Digit0: "٠" },
  Hebrew: { KeyZ: "ז", KeyC: "ב", KeyN: "מ", Period: "ץ" },
  Korean: { KeyZ: "ㅋ", KeyC: "ㅊ", KeyN: "ㅜ" },
  Thai: { KeyZ: "ผ", KeyC: "แ", KeyN: "ื", Period: "ใ" },
};
const US: Readonly<Record<string, string>> = {
  KeyZ: "z",
  KeyC: "c",
  KeyN: "n",
  KeyB: "b",
  Period: ".",
  BracketLeft: "[",
  BracketRight: "]",
  Digit0: "0",
};

test.each(Object.entries(LAYOUTS))("on a %s layout keys have the names of a US one", (_, keys) => {
  for (const [code, key] of Object.entries(keys)) expect(keyOf({ key, code })).toBe(US[code]);
  expect(keyOf({ key: keys.KeyZ?.toUpperCase() ?? "", code: "KeyZ", shiftKey: true })).toBe("Z");
});

test("a Latin layout means what it types, wherever the key stands", () => {
  expect(keyOf({ key: "z", code: "KeyY" })).toBe("z"); // German
  expect(keyOf({ key: "w", code: "KeyZ" })).toBe("w"); // French
  expect(keyOf({ key: "v", code: "Period" })).toBe("v"); // Dvorak
  expect(keyOf({ key: "ü", code: "BracketLeft" })).toBe("ü");
  expect(keyOf({ key: "¡", code: "Equal" })).toBe("¡");
  const altGraph = { getModifierState: () => true };
  expect(keyOf({ key: "…", code: "Period", ...altGraph })).toBe("…");
});

test("keys of an input method are nobody else's, in every way browsers tell it", () => {
  const ways: KeyPress[] = [
    { key: "Enter", isComposing: true },
    { key: "Enter", nativeEvent: { isComposing: true } },
    { key: "Enter", keyCode: 229 }, // Safari, once the word has ended
    { key: "Process", code: "Enter" },
  ];
  for (const way of ways) {
    expect(isComposing(way)).toBe(true);
    expect(keysOf(way)).toEqual(["Process"]);
    expect(typedCharacter(way)).toBe("");
  }
  expect(keyOf({ key: "Enter", keyCode: 13, isComposing: false })).toBe("Enter");
});

test("the key of Stop stops on every layout, and while a word is composed", () => {
  const stops: KeyPress[] = [
    { key: ".", code: "Period" },
    { key: ".", code: "KeyE" }, // Dvorak
    { key: ".", code: "Comma", shiftKey: true }, // French
    { key: ".", code: "Slash" }, // Russian, Hebrew: where the sign is printed
    { key: ".", code: "" },
    ...Object.values(LAYOUTS).flatMap(({ Period: key }) => (key ? [{ key, code: "Period" }] : [])),
    { key: "Ю", code: "Period", shiftKey: true },
    { key: "。", code: "Period" }, // Chinese, Japanese
    { key: "Process", code: "Period", keyCode: 229, isComposing: true },
    { key: ".", code: "Period", isComposing: true },
    { key: "Unidentified", code: "Period" },
    { key: ",", code: "NumpadDecimal" }, // German
  ];
  for (const press of stops) {
    expect({ press, stops: isStopKey({ ...press, ...ctrl }) }).toEqual({ press, stops: true });
    expect(isStopKey({ ...press, ctrlKey: false, metaKey: true })).toBe(true);
    expect(isStopKey({ ...press, ctrlKey: false, metaKey: false })).toBe(false);
  }
  const others: KeyPress[] = [
    { key: "v", code: "Period" }, // Dvorak: this pastes
    { key: ":", code: "Period" },
    { key: "Delete", code: "NumpadDecimal" },
    { key: "…", code: "Period", getModifierState: () => true },
  ];
  for (const press of others) expect(isStopKey({ ...press, ...ctrl })).toBe(false);
});

test("whatever a keyboard tells, a key has one name, and what is typed is never lost", () => {
  const press = fc.record({
    key: fc.oneof(fc.constantFrom("Enter", "Dead", "Process"), fc.string({ minLength: 1 })),
    code: fc.constantFrom("", "KeyA", "Digit1", "Period", "Enter", "NumpadDecimal", "toString"),
    shiftKey: fc.boolean(),
  });
  fc.assert(
    fc.property(press, (event) => {
      expect(keyOf(event)).not.toBe("");
      expect(keysOf(event)).toContain(keyOf(event));
      if (event.key !== "Process") expect(keysOf(event)).toContain(event.key);
    }),
  );
});
