/** Tabs beside an open action: its C++ package with the last build, its comments and its history. */

import { Tabs } from "@mantine/core";
import { useState } from "react";
import { type ActionBuild, useLastBuild } from "../api/library";
import { useThreads } from "../comments/use-threads";
import type { Action } from "../graph/model";
import { HistoryList } from "../history/history-list";
import { PackagePane } from "../packages/package-pane";
import { lazyPart, PartBoundary } from "../ui/lazy-part";
import { ago, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import style from "./open-action.module.css";

type BuildFault = ActionBuild["errors"][number];

/** Return the place of an error, such as `src/open_gripper.cpp:25:5`; empty if no file was named. */
export function faultPlace({ file, line, column }: BuildFault): string {
  return [file, line, column].filter((part) => part !== null && part !== "").join(":");
}

/** Return the result of a build in a few words. */
export function buildWords({ ended_well, errors }: ActionBuild): string {
  if (ended_well) return "built";
  if (errors.length === 0) return "not built, for errors of others in its package";
  return counted(errors.length, "error");
}

function LastBuild({ id }: { id: string }) {
  const { data } = useLastBuild(id);
  const now = useNow(20_000);
  const build = data?.build;
  if (!build) return null;
  const at = instant(build.at);
  return (
    <section
      aria-label="Last build"
      className={style.build}
      data-failed={!build.ended_well || undefined}
    >
      <p className="m-0 wrap gap-40">
        <b>Last build</b> {buildWords(build)}
        {at !== null && <time dateTime={build.at}>{ago(at, now)}</time>}
      </p>
      {build.errors.length > 0 && (
        <ul>
          {build.errors.map((fault) => (
            <li key={`${faultPlace(fault)} ${fault.message}`}>
              <code className="text-12 mono">{faultPlace(fault)}</code> {fault.message}
            </li>
          ))}
        </ul>
      )}
    </section>
  );
}

const Comments = lazyPart(() => import("../comments/comments").then((part) => part.Comments));

interface Props {
  id: string;
  action: Action | undefined;
  /** The moment (`seq`) on screen. */
  seq: number;
  mayEdit: boolean;
}

export function SidePane({ id, action, seq, mayEdit }: Props) {
  const threads = useThreads();
  const open = threads.filter(({ about, resolved }) => about === action?.key && !resolved).length;
  const [tab, setTab] = useState<string | null>("package");
  return (
    <Tabs value={tab} onChange={setTab} keepMounted={false} className="min-w-0">
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
