/** Beside an action: its C++ package, and what was done to it. */
import { Tabs } from "@mantine/core";
import { useState } from "react";
import { HistoryList } from "../../history/history-list";
import { PackagePane } from "../../packages/package-pane";
import { LastBuild } from "./last-build";
import style from "./open.module.css";

interface Props {
  id: string;
  /** The moment on screen. */
  seq: number;
  mayEdit: boolean;
}

export function SidePane({ id, seq, mayEdit }: Props) {
  const [tab, setTab] = useState<string | null>("package");
  return (
    <Tabs value={tab} onChange={setTab} keepMounted={false} className={style.side ?? ""}>
      <Tabs.List>
        <Tabs.Tab value="package">C++ package</Tabs.Tab>
        <Tabs.Tab value="history">History</Tabs.Tab>
      </Tabs.List>
      <Tabs.Panel value="package" className={style.panel ?? ""}>
        <LastBuild id={id} />
        <PackagePane graph={id} seq={seq} />
      </Tabs.Panel>
      <Tabs.Panel value="history" className={style.panel ?? ""}>
        <HistoryList id={id} seq={seq} mayEdit={mayEdit} />
      </Tabs.Panel>
    </Tabs>
  );
}
