/** Offers to end a run by a person's word: where no answer of its engine can prove that nothing moves. */

import { Button } from "@mantine/core";
import { IconEye } from "@tabler/icons-react";
import { useState } from "react";
import { needsRestConfirmation } from "../../api/run-stop";
import type { Run } from "../../api/runs";
import { useMay } from "../../api/use-person";
import { lazyPart } from "../../ui/parts/lazy-part";
import { OverlayBoundary } from "../../ui/parts/part-boundary";
import { isolated } from "../../words/isolated";

const ConfirmRestDialog = lazyPart(() =>
  import("./confirm-rest-dialog").then((part) => part.ConfirmRestDialog),
);

interface Props {
  /** As long as the button is there: what somebody says is about the robot that they looked at. */
  run: Run;
  /** On the red of a notice. */
  loud?: boolean;
  /** Whether it says at which robot. */
  named?: boolean;
}

export function ConfirmRestButton({ run, loud = false, named = false }: Props) {
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
        {named ? `I looked at ${isolated(run.engine)} …` : "I looked …"}
      </Button>
      <OverlayBoundary>
        {asking !== null && (
          <ConfirmRestDialog run={run} opened={asking} onClose={() => setAsking(false)} />
        )}
      </OverlayBoundary>
    </>
  );
}
