/** Beside an action: its C++ package, what people say about it, and what was done to it. */
import { Tabs } from "@mantine/core";
import { useState } from "react";
import { useThreads } from "../../comments/use-threads";
import type { Action } from "../../graph/model";
import { HistoryList } from "../../history/history-list";
import { PackagePane } from "../../packages/package-pane";
import { lazyPart } from "../../ui/parts/lazy-part";
import { PartBoundary } from "../../ui/parts/part-boundary";
import { LastBuild } from "./last-build";
import style from "./open.module.css";

const Comments = lazyPart(() => import("../../comments/comments").then((part) => part.Comments));

interface Props {
  id: string;
  action: Action | undefined;
  /** The moment on screen. */
  seq: number;
  mayEdit: boolean;
}

export function SidePane({ id, action, seq, mayEdit }: Props) {
  const threads = useThreads();
  const open = threads.filter(({ about, resolved }) => about === action?.key && !resolved).length;
  const [tab, setTab] = useState<string | null>("package");
  return (
    <Tabs value={tab} onChange={setTab} keepMounted={false} className={style.side ?? ""}>
      <Tabs.List>
        <Tabs.Tab value="package">C++ package</Tabs.Tab>
        <Tabs.Tab value="comments" aria-label={open === 0 ? "Comments" : `Comments, ${open} open`}>
          Comments{open > 0 && <span className={style.count}>{open}</span>}
        </Tabs.Tab>
        <Tabs.Tab value="history">History</Tabs.Tab>
      </Tabs.List>
      <Tabs.Panel value="package" className={style.panel ?? ""}>
        <LastBuild id={id} />
        <PackagePane graph={id} seq={seq} />
      </Tabs.Panel>
      <Tabs.Panel value="comments" className={style.panel ?? ""}>
        <PartBoundary>{action && <Comments threads={threads} only={action} />}</PartBoundary>
      </Tabs.Panel>
      <Tabs.Panel value="history" className={style.panel ?? ""}>
        <HistoryList id={id} seq={seq} mayEdit={mayEdit} />
      </Tabs.Panel>
    </Tabs>
  );
}
