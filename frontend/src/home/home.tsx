/** The first page: every graph by folders, and how to begin. */
import { Button } from "@mantine/core";
import { IconFileImport, IconPlus } from "@tabler/icons-react";
import type { ComponentProps, ReactNode } from "react";
import { useSearch } from "wouter";
import { folderWay, useFolders } from "../api/folders";
import { useMay } from "../api/people";
import { Empty } from "../ui/empty";
import { DeletedGraphs } from "./deleted-graphs";
import { FolderCards, FolderHead } from "./folders";
import { GraphList } from "./graph-list";
import style from "./home.module.css";

interface Props {
  onNew: () => void;
  onImport: () => void;
  /** Copies on this device, shown while the list cannot be read. */
  kept: ReactNode;
  /** Before the graphs: what is asked of who comes for the first time. */
  greeting?: ReactNode;
  Try: ComponentProps<typeof GraphList>["Try"];
}

function NoGraphs({ onNew }: Pick<Props, "onNew">) {
  const mayEdit = useMay("edit");
  return (
    <Empty
      icon={<IconPlus size={22} />}
      title="No graph yet"
      action={
        mayEdit && (
          <Button variant="filled" onClick={onNew}>
            New graph
          </Button>
        )
      }
    >
      {mayEdit
        ? "Begin with an empty one, or drop a UMRF file anywhere on this page."
        : "Graphs of others appear here."}
    </Empty>
  );
}

export function Home({ onNew, onImport, kept, greeting, Try }: Props) {
  const mayEdit = useMay("edit");
  const known = useFolders();
  const folders = known.data ?? [];
  const asked = new URLSearchParams(useSearch()).get("folder");
  const way = folderWay(folders, asked);
  const folder = way.at(-1)?.id ?? null;
  return (
    <main className="page">
      <div className={style.inner}>
        <div className={style.hello}>
          {folder === null ? (
            <div>
              <h2 className={style.title}>What should the robots do?</h2>
              <p className={style.lead}>
                Draw a task as a graph of actions, say what follows each outcome, run it in the
                simulator, and look at what happened. The examples below show one idea each.
              </p>
            </div>
          ) : (
            <FolderHead way={way} folders={folders} />
          )}
          {mayEdit && (
            <div className="flex gap-50">
              <Button leftSection={<IconFileImport size={16} />} onClick={onImport}>
                Import a file
              </Button>
              <Button variant="filled" leftSection={<IconPlus size={16} />} onClick={onNew}>
                New graph
              </Button>
            </div>
          )}
        </div>
        {greeting}
        {asked !== null && known.isSuccess && folder === null && (
          <p role="status">This folder is not there any more. Its graphs are where it was.</p>
        )}
        {(asked === null || !known.isPending) && (
          <GraphList
            key={folder}
            folders={folders}
            folder={folder}
            none={known.isSuccess && <NoGraphs onNew={onNew} />}
            kept={kept}
            Try={Try}
          >
            <FolderCards folder={folder} folders={folders} />
          </GraphList>
        )}
        <div className={style.foot}>
          <DeletedGraphs />
        </div>
      </div>
    </main>
  );
}
