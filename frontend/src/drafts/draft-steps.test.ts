import { expect, test } from "vitest";
import { answersWords, apartWords } from "./draft-steps";

const person = (name: string) => ({ id: name, name });
const answer = (yes: boolean, seq: number) => ({
  author: person("Ada"),
  at: "2026-01-01T00:00:00Z",
  note: "",
  yes,
  seq,
});

test("how far a draft and its graph are apart", () => {
  expect(apartWords({ ahead: 1, behind: 0 })).toBe("1 change ahead");
  expect(apartWords({ ahead: 3, behind: 1 })).toBe("3 changes ahead, 1 behind");
  expect(apartWords({ ahead: 0, behind: 0 })).toBe("nothing to merge");
  expect(apartWords({ ahead: null, behind: null })).toBe("");
});

test("what was said to a proposal, and whether to what is there now", () => {
  const proposal = { author: person("Ben"), at: "", note: "", seq: 4 };
  expect(answersWords(proposal, 4)).toBe("no answer yet");
  expect(answersWords({ ...proposal, answers: [answer(true, 4), answer(false, 4)] }, 4)).toBe(
    "1 yes, 1 no",
  );
  expect(answersWords({ ...proposal, answers: [answer(true, 4)] }, 5)).toBe("1 yes, changed since");
});
