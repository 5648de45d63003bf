/** Folders of graphs: the way to the one on screen, and those inside of it. */
import { Button } from "@mantine/core";
import { IconChevronRight, IconDots, IconFolder, IconFolderPlus } from "@tabler/icons-react";
import { type ComponentProps, Fragment, useState } from "react";
import { Link } from "wouter";
import { type Folder, placeOfFolder } from "../api/folders";
import { useMay } from "../api/people";
import { LateOpening } from "../ui/late-opening";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import type { FolderMenu } from "./folder-menu";
import style from "./folders.module.css";
import { RestrictedMark } from "./graph-counts";

const FolderNameDialog = lazyPart(() =>
  import("./folder-dialogs").then((part) => part.FolderNameDialog),
);
const Menu = lazyPart(() => import("./folder-menu").then((part) => part.FolderMenu));

function FolderButton(props: Omit<ComponentProps<typeof FolderMenu>, "button">) {
  return (
    <LateOpening opens="menu" part={(button) => <Menu {...props} button={button} />}>
      <button
        type="button"
        className={style.more}
        aria-label={`More about the folder ${isolated(props.folder.name)}`}
      >
        <IconDots size={16} aria-hidden />
      </button>
    </LateOpening>
  );
}

/** The folder on screen: its name, the way to it, and its menu. */
export function FolderHead({
  way,
  folders,
}: {
  way: readonly Folder[];
  folders: readonly Folder[];
}) {
  const mayEdit = useMay("edit");
  const folder = way.at(-1);
  if (folder === undefined) return null;
  return (
    <div className="min-w-0">
      <nav aria-label="Way to this folder" className={style.way}>
        <Link to="/">All graphs</Link>
        {way.slice(0, -1).map(({ id, name }) => (
          <Fragment key={id}>
            <IconChevronRight size={13} aria-hidden />
            <Link to={placeOfFolder(id)}>{name}</Link>
          </Fragment>
        ))}
      </nav>
      <div className="row gap-50">
        <IconFolder size={22} aria-hidden className="flex-none" />
        <h2 className={style.title}>
          <span className="visually-hidden">Folder </span>
          {folder.name}
        </h2>
        {folder.restricted && <RestrictedMark />}
        {mayEdit && <FolderButton folder={folder} folders={folders} here />}
      </div>
    </div>
  );
}

/** The folders in a folder (null: those in none), and the way to a new one. */
export function FolderCards({
  folder,
  folders,
}: {
  folder: string | null;
  folders: readonly Folder[];
}) {
  const mayEdit = useMay("edit");
  // Null until it was asked for: from then on it stays, and gives the focus back when it closes.
  const [making, setMaking] = useState<boolean | null>(null);
  const inside = (id: string | null) => folders.filter((each) => (each.parent ?? null) === id);
  const shown = inside(folder);
  if (!mayEdit && shown.length === 0) return null;
  return (
    <section aria-label="Folders" className={style.folders}>
      {shown.length > 0 && (
        <ul className={`${style.cards} list-reset`}>
          {shown.map((each) => {
            const below = inside(each.id).length;
            return (
              <li key={each.id} className={style.card}>
                <Link to={placeOfFolder(each.id)} className={style.open}>
                  <IconFolder size={20} aria-hidden className="flex-none" />
                  <span className="fill">
                    <span className="row gap-25">
                      <bdi className="truncate weight-600">{each.name}</bdi>
                      {each.restricted && <RestrictedMark />}
                    </span>
                    <span className="faint-11_5">
                      {counted(each.graphs ?? 0, "graph")}
                      {below > 0 && ` · ${counted(below, "folder")}`}
                    </span>
                  </span>
                </Link>
                {mayEdit && <FolderButton folder={each} folders={folders} />}
              </li>
            );
          })}
        </ul>
      )}
      {mayEdit && (
        <Button
          variant="subtle"
          color="gray"
          leftSection={<IconFolderPlus size={16} aria-hidden />}
          onClick={() => setMaking(true)}
        >
          New folder
        </Button>
      )}
      <OverlayBoundary>
        {making !== null && (
          <FolderNameDialog parent={folder} opened={making} onClose={() => setMaking(false)} />
        )}
      </OverlayBoundary>
    </section>
  );
}
