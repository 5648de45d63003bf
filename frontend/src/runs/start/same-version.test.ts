import { expect, test } from "vitest";
import type { Version } from "../../api/graphs";
import { sameVersion } from "./same-version";

const version = (id: string, seq: number, digest: string, tree_digest = `tree ${digest}`) =>
  ({ id, seq, digest, tree_digest, label: "", at: "2026-01-01T00:00:00Z" }) as unknown as Version;

test("a moment that differs in comments only says which version had the same graph", () => {
  const versions = [version("c", 9, "y"), version("b", 5, "x"), version("a", 2, "x")];
  const now = { digest: "x", tree: "tree x", seq: 12 };
  expect(sameVersion(versions, now)).toBe("v2");
  expect(sameVersion(versions, { ...now, seq: 5 })).toBe("v1");
  expect(sameVersion(versions, { ...now, tree: "tree with another graph inside" })).toBe("");
  expect(sameVersion(versions, { ...now, digest: "" })).toBe("");
});
