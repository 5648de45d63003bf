import { readFileSync } from "node:fs";
import { fileURLToPath } from "node:url";
import { expect, test } from "vitest";
import { exampleOf } from "./examples";

const file = new URL("../../../../tests/vectors/examples.json", import.meta.url);
const vectors = JSON.parse(readFileSync(fileURLToPath(file), "utf8")) as [string, string | null][];

test.each(vectors)("the example of %s is the value %s", (parameter, value) => {
  expect(exampleOf(parameter)).toBe(value);
});
