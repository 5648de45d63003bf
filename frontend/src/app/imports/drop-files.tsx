/** Takes files that are dropped anywhere on the page. */
import { IconFileImport } from "@tabler/icons-react";
import { type ReactNode, useEffect, useRef, useState } from "react";
import { useMay } from "../../api/people";
import style from "./drop-files.module.css";
import type { Dropped } from "./dropped-files";
import { useNewGraphs } from "./new-graphs";

function hasFiles(event: DragEvent): boolean {
  return [...(event.dataTransfer?.types ?? [])].includes("Files");
}

/** Read while the drop is heard: what was dropped is forgotten right after it. */
function whatWasDropped(dropped: DataTransfer | null): Dropped {
  const items = [...(dropped?.items ?? [])];
  return {
    files: [...(dropped?.files ?? [])],
    entries: items.map((item) => item.webkitGetAsEntry?.() ?? null),
  };
}

export function DropFiles({ children }: { children: ReactNode }) {
  const { take } = useNewGraphs();
  const mayEdit = useMay("edit");
  const [over, setOver] = useState(false);
  const depth = useRef(0);
  useEffect(() => {
    if (!mayEdit) return;
    const enter = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      depth.current += 1;
      setOver(true);
    };
    const leave = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      depth.current = Math.max(0, depth.current - 1);
      if (depth.current === 0) setOver(false);
    };
    const allow = (event: DragEvent) => {
      if (hasFiles(event)) event.preventDefault();
    };
    const drop = (event: DragEvent) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      depth.current = 0;
      setOver(false);
      const dropped = whatWasDropped(event.dataTransfer);
      void import("./dropped-files").then((part) => part.droppedFiles(dropped)).then(take);
    };
    const pairs = [
      ["dragenter", enter],
      ["dragleave", leave],
      ["dragover", allow],
      ["drop", drop],
    ] as const;
    for (const [name, listener] of pairs) window.addEventListener(name, listener);
    return () => {
      for (const [name, listener] of pairs) window.removeEventListener(name, listener);
    };
  }, [take, mayEdit]);
  return (
    <>
      {children}
      {over && (
        <div className={style.over} aria-hidden>
          <div className={style.card}>
            <IconFileImport size={28} />
            Drop to import graphs and actions
          </div>
        </div>
      )}
    </>
  );
}
