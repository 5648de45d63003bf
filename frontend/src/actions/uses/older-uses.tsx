/** Graphs that still use older parameters of an action, and the way to update them. */
import { Button } from "@mantine/core";
import { useState } from "react";
import { useMay } from "../../api/use-person";
import { lazyPart } from "../../ui/parts/lazy-part";
import { OverlayBoundary } from "../../ui/parts/part-boundary";
import style from "../open/open.module.css";

const UpdateDialog = lazyPart(() => import("./update-dialog").then((part) => part.UpdateDialog));

interface Props {
  id: string;
  name: string;
  count: number;
}

export function OlderUses({ id, name, count }: Props) {
  const mayEdit = useMay("edit");
  // Null until it was asked for: from then on it stays, and gives the focus back when it closes.
  const [open, setOpen] = useState<boolean | null>(null);
  return (
    <section className={style.notice} aria-label="Older parameters" hidden={count === 0}>
      <p>
        {count === 1
          ? "1 graph still uses the older parameters."
          : `${count} graphs still use the older parameters.`}
      </p>
      <Button className={style.tool ?? ""} onClick={() => setOpen(true)}>
        {mayEdit ? "Look and update" : "Look"}
      </Button>
      <OverlayBoundary>
        {open !== null && (
          <UpdateDialog
            id={id}
            name={name}
            mayEdit={mayEdit}
            opened={open}
            onClose={() => setOpen(false)}
          />
        )}
      </OverlayBoundary>
    </section>
  );
}
