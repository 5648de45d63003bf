/** Offers to end a run by a person's word: where no answer of its engine can prove that nothing moves. */
import { Button } from "@mantine/core";
import { IconEye } from "@tabler/icons-react";
import { useState } from "react";
import { needsRestConfirmation, type Run } from "../../api/runs";
import { useMay } from "../../api/use-person";
import { lazyPart } from "../../ui/parts/lazy-part";
import { OverlayBoundary } from "../../ui/parts/part-boundary";

const ConfirmRestDialog = lazyPart(() =>
  import("./confirm-rest-dialog").then((part) => part.ConfirmRestDialog),
);

/** `loud`: on the red of a notice. */
export function ConfirmRestButton({ run, loud = false }: { run: Run; loud?: boolean }) {
  const may = useMay("operate");
  const [asking, setAsking] = useState<boolean | null>(null);
  if (!may || !needsRestConfirmation(run)) return null;
  return (
    <>
      <Button
        size={loud ? "xs" : "compact-xs"}
        variant={loud ? "white" : "light"}
        color="red"
        flex="none"
        leftSection={<IconEye size={14} aria-hidden />}
        onClick={() => setAsking(true)}
      >
        I looked …
      </Button>
      <OverlayBoundary>
        {asking !== null && (
          <ConfirmRestDialog run={run} opened={asking} onClose={() => setAsking(false)} />
        )}
      </OverlayBoundary>
    </>
  );
}
