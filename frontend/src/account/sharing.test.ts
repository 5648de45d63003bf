import { expect, test } from "vitest";
import { credentialIn } from "../api/session";
import type { Guest, Sharing } from "../api/sharing";
import { guestWords, originsOf } from "./share-dialog";
import { pastedCredential } from "./sign-in";
import { frameText } from "./view-links";

const at = "2026-01-01T00:00:00Z";
const guest = (name: string): Guest => ({ person: { id: name, name }, at });

test("a link is told from a token, wherever it stands", () => {
  expect(credentialIn("http://lab:8000/#i=abc.DEF-_1")).toEqual({
    kind: "invitation",
    text: "abc.DEF-_1",
  });
  expect(credentialIn("#t=secret")).toEqual({ kind: "token", text: "secret" });
  expect(credentialIn("http://lab:8000/graphs/x")).toBeNull();
  expect(pastedCredential("  secret ")).toEqual({ kind: "token", text: "secret" });
  expect(pastedCredential("http://lab:8000/#i=abc.D")).toEqual({
    kind: "invitation",
    text: "abc.D",
  });
});

test("links begin with the place where the owner has the page, unless others cannot reach it", () => {
  const sharing: Sharing = {
    origins: ["http://10.0.0.2:8000", "http://lab.local:8000"],
    secure: false,
    proxied: false,
    invitations: [],
  };
  const here = { page: "http://127.0.0.1:8000", hostname: "127.0.0.1" };
  const there = { page: "http://lab.local:8000", hostname: "lab.local" };
  expect(originsOf(sharing, here)).toEqual(sharing.origins);
  expect(originsOf(sharing, there)).toEqual(["http://lab.local:8000", "http://10.0.0.2:8000"]);
  expect(originsOf({ ...sharing, origins: [] }, here)).toEqual([]);
});

test("who came in is said by name, and many as a number", () => {
  expect(guestWords([])).toBe("Not used yet");
  expect(guestWords([guest("Ada"), guest("")])).toBe("Ada, Guest came in");
  const many = Array.from({ length: 9 }, (_, i) => guest(`P${i}`));
  expect(guestWords(many)).toBe("P0, P1, P2, P3, P4, P5 and 3 more came in");
});

test("the frame of a link quotes its title, and lets the page open no windows", () => {
  const text = frameText("https://lab.example/view#run=view_a_b", '"><script>&');
  expect(text).toContain('title="&quot;>&lt;script>&amp;"');
  expect(text).toContain('sandbox="allow-scripts allow-same-origin"');
  expect(text).not.toContain("<script");
});
