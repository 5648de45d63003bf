/** Requests about a draft, with their progress and errors; words about drafts and proposals. */
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { type DraftProposal, type GraphDraft, refreshDrafts } from "../api/drafts";
import { errorText } from "../api/http";
import { counted } from "../words/counted";

export function useDraftStep() {
  const client = useQueryClient();
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  const step = async (work: () => Promise<unknown>): Promise<void> => {
    setBusy(true);
    setWrong("");
    try {
      await work();
    } catch (error) {
      setWrong(errorText(error));
    } finally {
      setBusy(false);
      await refreshDrafts(client);
    }
  };
  return { busy, wrong, step };
}

const things = (count: number) => counted(count, "change");

/** Return how far a draft and its origin are apart, in words; empty while that is unknown. */
export function apartWords({ ahead, behind }: Pick<GraphDraft, "ahead" | "behind">): string {
  if (ahead === null || behind === null) return "";
  if (ahead === 0 && behind === 0) return "nothing to merge";
  const parts = [ahead > 0 && `${things(ahead)} ahead`, behind > 0 && `${behind} behind`];
  return parts.filter(Boolean).join(", ");
}

/** Return the answers to a proposal in words. */
export function answersWords({ answers = [], seq }: DraftProposal, now: number): string {
  const yes = answers.filter((each) => each.yes).length;
  const no = answers.length - yes;
  const said = [yes > 0 && `${yes} yes`, no > 0 && `${no} no`].filter(Boolean).join(", ");
  const earlier = Math.min(seq, ...answers.map((each) => each.seq)) < now;
  return `${said || "no answer yet"}${earlier ? ", changed since" : ""}`;
}
