/** Says that this person, while away, and others have changed the same, and leads to both values. */
import { Button } from "@mantine/core";
import { IconGitMerge } from "@tabler/icons-react";
import { useState } from "react";
import type { ChangedTwice } from "../sync/changed-twice";
import { ChangedTwiceDialog } from "./changed-twice-dialog";
import { useChangedTwiceTold } from "./changed-twice-words";
import { Say } from "./room-notice";

export function ChangedTwiceNotice({ all }: { all: readonly ChangedTwice[] }) {
  const told = useChangedTwiceTold(all);
  const [open, setOpen] = useState(false);
  if (told.length === 0) return null;
  return (
    <Say
      icon={<IconGitMerge size={16} />}
      tone="warn"
      action={
        <Button size="compact-sm" onClick={() => setOpen(true)}>
          Choose
        </Button>
      }
    >
      While you were away, others changed{" "}
      {told.length === 1 ? "something" : `${told.length} things`} that you changed, too. One of both
      values stands.
      <ChangedTwiceDialog told={told} opened={open} onClose={() => setOpen(false)} />
    </Say>
  );
}
