/** Menu of a folder: rename, move, rights and removal. */
import { Menu } from "@mantine/core";
import { IconFolderMinus, IconFolderSymlink, IconLock, IconPencil } from "@tabler/icons-react";
import { type ReactElement, useState } from "react";
import { useLocation } from "wouter";
import { type Folder, foldersWithin, moveFolder, placeOfFolder } from "../api/folders";
import { useMay } from "../api/people";
import { useOpening } from "../ui/late-opening";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";

const FolderNameDialog = lazyPart(() =>
  import("./folder-dialogs").then((part) => part.FolderNameDialog),
);
const MoveDialog = lazyPart(() => import("./folder-dialogs").then((part) => part.MoveDialog));
const RuleDialog = lazyPart(() => import("./rule-dialog").then((part) => part.RuleDialog));
const RemoveDialog = lazyPart(() => import("./folder-dialogs").then((part) => part.RemoveDialog));

interface Props {
  folder: Folder;
  folders: readonly Folder[];
  /** The folder is the one on screen: who removes it goes to the one around it. */
  here?: boolean;
  button: ReactElement;
}

/** The menu of a folder, around its button. */
export function FolderMenu({ folder, folders, here = false, button }: Props) {
  const [, go] = useLocation();
  const [asked, setAsked] = useState<"rename" | "move" | "rule" | "remove" | null>(null);
  const [opened, setOpened] = useState(false);
  const [isOpen, setOpen] = useOpening();
  const mayShare = useMay("share");
  const ask = (dialog: typeof asked) => {
    setAsked(dialog);
    setOpened(true);
  };
  const dialog = { opened, onClose: () => setOpened(false) };
  return (
    <>
      <Menu opened={isOpen} onChange={setOpen}>
        <Menu.Target>{button}</Menu.Target>
        <Menu.Dropdown>
          <Menu.Item leftSection={<IconPencil size={15} />} onClick={() => ask("rename")}>
            Rename …
          </Menu.Item>
          <Menu.Item leftSection={<IconFolderSymlink size={15} />} onClick={() => ask("move")}>
            Move to folder …
          </Menu.Item>
          {mayShare && (
            <Menu.Item leftSection={<IconLock size={15} />} onClick={() => ask("rule")}>
              Who may see and edit its graphs …
            </Menu.Item>
          )}
          <Menu.Item leftSection={<IconFolderMinus size={15} />} onClick={() => ask("remove")}>
            Remove the folder …
          </Menu.Item>
        </Menu.Dropdown>
      </Menu>
      <OverlayBoundary>
        {asked === "rename" && <FolderNameDialog folder={folder} {...dialog} />}
        {asked === "move" && (
          <MoveDialog
            name={folder.name}
            from={folder.parent ?? null}
            not={foldersWithin(folders, folder.id)}
            move={(into) => moveFolder(folder.id, into)}
            {...dialog}
          />
        )}
        {asked === "rule" && (
          <RuleDialog
            ruled={{ kind: "folder", id: folder.id }}
            name={folder.name}
            isInside={folder.parent !== undefined}
            {...dialog}
          />
        )}
        {asked === "remove" && (
          <RemoveDialog
            folder={folder}
            folders={folders}
            onRemoved={() => here && go(placeOfFolder(folder.parent))}
            {...dialog}
          />
        )}
      </OverlayBoundary>
    </>
  );
}
