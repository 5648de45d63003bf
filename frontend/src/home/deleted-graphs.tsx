/** The way to graphs, or actions of the library, that were deleted. */
import { Button } from "@mantine/core";
import { IconTrash } from "@tabler/icons-react";
import { useState } from "react";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";

const DeletedGraphsDialog = lazyPart(() =>
  import("./deleted-graphs-dialog").then((part) => part.DeletedGraphsDialog),
);

export function DeletedGraphs({ kind = "graph" }: { kind?: "graph" | "action" }) {
  // Null until it was asked for: from then on it stays, and gives the focus back when it closes.
  const [open, setOpen] = useState<boolean | null>(null);
  return (
    <>
      <Button
        variant="subtle"
        color="gray"
        leftSection={<IconTrash size={15} aria-hidden />}
        onClick={() => setOpen(true)}
      >
        {kind === "graph" ? "Deleted graphs" : "Deleted actions"}
      </Button>
      <OverlayBoundary>
        {open !== null && (
          <DeletedGraphsDialog kind={kind} opened={open} onClose={() => setOpen(false)} />
        )}
      </OverlayBoundary>
    </>
  );
}
