/** Drafts in a few words. Pure. */
import type { DraftProposal, GraphDraft } from "../api/documents/drafts";

const things = (count: number) => (count === 1 ? "1 change" : `${count} changes`);

/** How far both are apart; empty while that is not known. */
export function apartWords({ ahead, behind }: Pick<GraphDraft, "ahead" | "behind">): string {
  if (ahead === null || behind === null) return "";
  if (ahead === 0 && behind === 0) return "nothing to merge";
  const parts = [ahead > 0 && `${things(ahead)} ahead`, behind > 0 && `${behind} behind`];
  return parts.filter(Boolean).join(", ");
}

/** What was said to a proposal. */
export function answersWords({ answers = [], seq }: DraftProposal, now: number): string {
  const yes = answers.filter((each) => each.yes).length;
  const no = answers.length - yes;
  const said = [yes > 0 && `${yes} yes`, no > 0 && `${no} no`].filter(Boolean).join(", ");
  const earlier = Math.min(seq, ...answers.map((each) => each.seq)) < now;
  return `${said || "no answer yet"}${earlier ? ", changed since" : ""}`;
}
