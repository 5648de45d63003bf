/** The choice of a phone to draw placed graphs top-down, for its screen alone. */
import { Button } from "@mantine/core";
import { IconArrowsRightDown } from "@tabler/icons-react";
import { useKept } from "../ui/hooks";

export function useTopDown() {
  const [isTurned, turn] = useKept("aa.top-down", false);
  return { isTurned, turn };
}

/** Turns a graph for this screen, and back. */
export function TopDownButton() {
  const { isTurned, turn } = useTopDown();
  return (
    <Button
      size="compact-sm"
      variant="default"
      leftSection={<IconArrowsRightDown size={15} aria-hidden />}
      title="Only on this screen, and only to look at"
      onClick={() => turn(!isTurned)}
    >
      {isTurned ? "As placed" : "Top-down"}
    </Button>
  );
}
