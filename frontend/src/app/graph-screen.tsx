/** The editor of a graph with the list on its left and its runs below. */
import { Button } from "@mantine/core";
import { IconMapOff } from "@tabler/icons-react";
import { type ReactNode, useMemo } from "react";
import { Link } from "wouter";
import { usePerson } from "../account/person";
import { useVersions, versionName } from "../api/graphs";
import { progressByAid } from "../api/progress";
import type { Run } from "../api/runs";
import { newestRun, useLive } from "../api/use-live";
import { Editor, type Shown } from "../editor/editor";
import { useKnownActions } from "../library/known";
import { Sidebar } from "../library/sidebar";
import { roomUrl } from "../room/connect";
import { RoomProvider, useLink } from "../room/use-room";
import { DraftWord } from "../runs/draft-word";
import { LiveWord } from "../runs/live-word";
import { RunStrip } from "../runs/run-strip";
import { StartControl } from "../runs/start-control";
import { Empty } from "../ui/empty";
import { useNewGraphs } from "./files";
import { Bar, Frame } from "./frame";
import { useTitle } from "./title";

function useRunHere(id: string): { run: Run | null; label: string; unsure: boolean } {
  const { now } = useLive();
  const run = newestRun(now, id);
  const versions = useVersions(id, run?.version ?? null).data;
  const label = versionName(versions, run?.version ?? null) || run?.digest.slice(0, 7) || "";
  return { run, label, unsure: now.link === "down" && run?.ended_at === null };
}

function Inside({ id }: { id: string }) {
  const { person } = usePerson();
  const { create, choose } = useNewGraphs();
  const { actions } = useKnownActions();
  const known = useMemo(() => actions.map((action) => action.template), [actions]);
  const { run, label, unsure } = useRunHere(id);
  const progress = useMemo(() => progressByAid(run, unsure), [run, unsure]);
  const link = useLink();
  if (link.state === "refused" && link.why === "no-such-graph" && link.seq === 0) return <Gone />;
  return (
    <Editor
      id={id}
      me={person.id}
      known={known}
      progress={progress}
      bar={(parts) => <TitledBar id={id} {...parts} />}
      list={(place) => <Sidebar current={id} onNew={create} onImport={choose} onPlace={place} />}
      status={(shown: Shown) => (
        <DraftWord run={run} label={label} graph={shown.graph} seq={shown.seq} />
      )}
      start={(shown: Shown) => (
        <StartControl
          graph={id}
          seq={shown.seq}
          obstacle={shown.obstacle}
          compact={shown.compact}
        />
      )}
      strip={(shown: Shown) => (
        <RunStrip
          run={run}
          graph={shown.graph}
          versionLabel={label}
          selected={shown.selected}
          onPick={shown.pick}
        />
      )}
      corner={<LiveWord />}
    />
  );
}

function TitledBar(props: { id: string } & Parameters<typeof Bar>[0]) {
  const { id, ...parts } = props;
  const here = parts.crumbs.at(-1)?.label;
  useTitle(typeof here === "string" ? here : "Graph");
  return <Bar graph={id} {...parts} />;
}

function Gone() {
  return (
    <>
      <Bar crumbs={[{ label: "Graphs", to: "/" }, { label: "Gone" }]} />
      <main>
        <Empty
          icon={<IconMapOff size={22} />}
          title="There is no such graph"
          action={
            <Button component={Link} to="/">
              All graphs
            </Button>
          }
        >
          It was deleted, or the address is of another server.
        </Empty>
      </main>
    </>
  );
}

export function GraphScreen({ id }: { id: string }): ReactNode {
  return (
    <Frame>
      <RoomProvider url={roomUrl(id)} fallback={<Bar crumbs={[{ label: "Graphs", to: "/" }]} />}>
        <Inside id={id} />
      </RoomProvider>
    </Frame>
  );
}
