import { expect, test } from "vitest";
import { buildWords, faultPlace } from "./side-pane";

const fault = { message: "no", file: "src/go.cpp", line: 25, column: 5 };
const build = { package: "go", ended_well: false, at: "2026-11-23T10:00:00Z", errors: [fault] };

test("an error shows its file, line and column as far as they are known", () => {
  expect(faultPlace(fault)).toBe("src/go.cpp:25:5");
  expect(faultPlace({ ...fault, column: null })).toBe("src/go.cpp:25");
  expect(faultPlace({ ...fault, file: "", line: null, column: null })).toBe("");
});

test("a failed build is never described as built", () => {
  expect(buildWords(build)).toBe("1 error");
  expect(buildWords({ ...build, errors: [fault, fault] })).toBe("2 errors");
  expect(buildWords({ ...build, errors: [] })).toContain("not built");
  expect(buildWords({ ...build, ended_well: true, errors: [] })).toBe("built");
});
