/** Something that is done with a draft: while it goes on, and what is said where it is refused. */
import { useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { refreshDrafts } from "../api/documents/drafts";
import { errorText } from "../api/http";

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
