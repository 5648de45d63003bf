import { expect, test } from "vitest";
import { headOf, noticeOfSites } from "./stop-notice";

test("one notice says of each site what it has to, the loudest first, and names it", () => {
  const joined = noticeOfSites([
    { name: "Hall A", notice: { tone: "done", text: "Run 1: stopped." } },
    {
      name: "Hall B",
      notice: { tone: "loud", stays: true, text: "NOT SENT: use the hardware stop." },
    },
    { name: "Hall C", notice: null },
  ]);
  expect(joined).toEqual({
    tone: "loud",
    stays: true,
    text: "NOT SENT at Hall B: use the hardware stop. Hall A: Run 1: stopped.",
  });
  expect(joined && headOf(joined)).toBe("NOT SENT at Hall B");
  expect(noticeOfSites([{ name: "Hall A", notice: null }])).toBeNull();
});
