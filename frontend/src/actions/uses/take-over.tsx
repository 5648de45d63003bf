/** The way to what a robot has, where that differs from what the library says. */
import { Button } from "@mantine/core";
import { useState } from "react";
import type { RobotAction } from "../../library/robot-actions";
import { lazyPart } from "../../ui/parts/lazy-part";
import { OverlayBoundary } from "../../ui/parts/part-boundary";

const TakeOverDialog = lazyPart(() =>
  import("./take-over-dialog").then((part) => part.TakeOverDialog),
);

interface Props {
  /** The document of the action. */
  id: string;
  has: RobotAction;
}

export function TakeOver({ id, has }: Props) {
  // Null until it was asked for: from then on it stays, and gives the focus back when it closes.
  const [open, setOpen] = useState<boolean | null>(null);
  return (
    <>
      <Button size="compact-sm" variant="subtle" onClick={() => setOpen(true)}>
        Take over from <bdi>{has.robot}</bdi>
      </Button>
      <OverlayBoundary>
        {open !== null && (
          <TakeOverDialog id={id} has={has} opened={open} onClose={() => setOpen(false)} />
        )}
      </OverlayBoundary>
    </>
  );
}
