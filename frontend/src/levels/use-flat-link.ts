/** Offers one graph without graphs inside, once, where the address asks for that: `?flat`. */
import { useEffect } from "react";
import { useSearch } from "wouter";
import { useEditorContext } from "../edit-actions/editor-context";
import { useStableCallback } from "../ui/hooks/use-stable-callback";

export function useFlatLink(): void {
  const { openOverlay } = useEditorContext();
  const asked = new URLSearchParams(useSearch()).has("flat");
  const answer = useStableCallback(() => {
    openOverlay({ kind: "flat" });
    const answered = new URL(window.location.href);
    answered.searchParams.delete("flat");
    window.history.replaceState(window.history.state, "", answered);
  });
  useEffect(() => {
    if (asked) answer();
  }, [asked, answer]);
}
