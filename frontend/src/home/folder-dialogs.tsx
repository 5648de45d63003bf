/** Dialogs of folders: give one a name, choose one to move something into, and remove one. */
import { Button, Group, Modal, Radio, Text, TextInput } from "@mantine/core";
import { type UseMutationResult, useMutation, useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useRef, useState } from "react";
import { renewing } from "../api/client";
import {
  type Folder,
  folderPath,
  foldersInOrder,
  makeFolder,
  removeFolder,
  renameFolder,
  useFolders,
} from "../api/folders";
import { tellRunnerRules } from "../api/graph-rights";
import { refreshGraphs } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./folders.module.css";

interface Dialog {
  opened: boolean;
  onClose: () => void;
}

/** Return a function that brings the rules that count after a move to the runner, for owners. */
function useTellRules(): () => Promise<void> {
  const mayShare = useMay("share");
  const { runner } = useLive();
  return async () => {
    if (mayShare) await tellRunnerRules(runner);
  };
}

/** A change of folders: the dialog closes when it is done, and says why where it is refused. */
function useChange(change: () => Promise<unknown>, onDone: () => void) {
  const client = useQueryClient();
  return useMutation({
    mutationFn: change,
    onSuccess: onDone,
    onSettled: renewing(() => refreshGraphs(client)),
  });
}

interface FormProps {
  change: UseMutationResult<unknown, Error, void>;
  word: string;
  ready: boolean;
  onClose: () => void;
  children: ReactNode;
}

function ChangeForm({ change, word, ready, onClose, children }: FormProps) {
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (ready && !change.isPending) change.mutate();
      }}
    >
      {children}
      {change.isError && (
        <Text c="var(--error)" mt="xs" role="alert">
          {errorText(change.error)}
        </Text>
      )}
      <Group justify="flex-end" mt="md">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" disabled={!ready} loading={change.isPending}>
          {word}
        </Button>
      </Group>
    </form>
  );
}

interface NameProps {
  /** The folder that gets another name; without it a new one is made in `parent`. */
  folder?: Folder;
  parent?: string | null;
  onClose: () => void;
}

function FolderName({ folder, parent = null, onClose }: NameProps) {
  const [name, setName] = useState(folder?.name ?? "");
  const wanted = name.trim();
  const change = useChange(
    () => (folder ? renameFolder(folder.id, wanted) : makeFolder(wanted, parent)),
    onClose,
  );
  const ready = wanted !== "" && wanted !== folder?.name;
  return (
    <ChangeForm change={change} word={folder ? "Rename" : "Make"} ready={ready} onClose={onClose}>
      <TextInput
        label="Name of the folder"
        value={name}
        maxLength={100}
        data-autofocus
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setName(event.currentTarget.value)}
      />
    </ChangeForm>
  );
}

const close = { closeButtonProps: { "aria-label": "Close" }, centered: true };

export function FolderNameDialog({ opened, ...props }: NameProps & Dialog) {
  const title = props.folder ? `Rename ${isolated(props.folder.name)}` : "New folder";
  return (
    <Modal opened={opened} onClose={props.onClose} title={title} {...close}>
      <FolderName {...props} />
    </Modal>
  );
}

interface MoveProps {
  /** Name of the thing that is moved. */
  name: string;
  /** The folder that it is in; null: in none. */
  from: string | null;
  /** Folders that it cannot be moved into. */
  not?: ReadonlySet<string>;
  move: (into: string | null) => Promise<unknown>;
  onClose: () => void;
}

const NONE = "";

function MoveChoice({ from, not, move, onClose }: MoveProps) {
  const folders = useFolders().data ?? [];
  const [into, setInto] = useState(from ?? NONE);
  const [fresh, setFresh] = useState("");
  const tellRules = useTellRules();
  const change = useChange(async () => {
    const chosen = into === NONE ? null : into;
    const made = fresh.trim() === "" ? null : await makeFolder(fresh.trim(), chosen);
    if (made !== null) {
      // It is there now: another try moves into it, and makes no second one.
      setInto(made.id);
      setFresh("");
    }
    await move(made?.id ?? chosen);
    await tellRules();
  }, onClose);
  // What failed may be done at the editor alone: it can be tried again as it is.
  const ready = change.isError || fresh.trim() !== "" || into !== (from ?? NONE);
  return (
    <ChangeForm change={change} word="Move" ready={ready} onClose={onClose}>
      <Radio.Group
        value={into}
        onChange={setInto}
        aria-label="Folder"
        className={style.choices ?? ""}
      >
        <Radio value={NONE} label="No folder" data-autofocus={into === NONE || undefined} />
        {foldersInOrder(folders)
          .filter(({ folder }) => !not?.has(folder.id))
          .map(({ folder, depth }) => (
            <Radio
              key={folder.id}
              value={folder.id}
              label={<bdi>{folder.name}</bdi>}
              style={{ paddingInlineStart: `${(depth + 1) * 1.1}rem` }}
              data-autofocus={into === folder.id || undefined}
            />
          ))}
      </Radio.Group>
      <TextInput
        label="Or a new folder inside of it"
        value={fresh}
        maxLength={100}
        onChange={(event) => setFresh(event.currentTarget.value)}
      />
    </ChangeForm>
  );
}

export function MoveDialog({ opened, ...props }: MoveProps & Dialog) {
  return (
    <Modal
      opened={opened}
      onClose={props.onClose}
      title={`Move ${isolated(props.name)} to a folder`}
      {...close}
    >
      <MoveChoice {...props} />
    </Modal>
  );
}

interface RemoveProps {
  folder: Folder;
  folders: readonly Folder[];
  onRemoved: () => void;
  onClose: () => void;
}

function Remove({ folder, folders, onRemoved, onClose }: RemoveProps) {
  const tellRules = useTellRules();
  const isRemoved = useRef(false);
  const change = useChange(
    async () => {
      if (!isRemoved.current) await removeFolder(folder.id);
      isRemoved.current = true; // another try only tells the runner
      await tellRules();
    },
    () => {
      onClose();
      onRemoved();
    },
  );
  const below = folders.filter(({ parent }) => parent === folder.id).length;
  const contents = [
    ...(folder.graphs ? [counted(folder.graphs, "graph")] : []),
    ...(below > 0 ? [counted(below, "folder")] : []),
  ];
  const around = folderPath(folders, folder.parent);
  return (
    <ChangeForm change={change} word="Remove the folder" ready onClose={onClose}>
      <Text>
        {contents.length === 0
          ? "Nothing is in it. Deleted graphs that were in it can still be brought back."
          : `Its contents (${contents.join(", ")}) go ${
              around === "" ? "to the graphs in no folder" : `into ${isolated(around)}`
            }. No graph is deleted.`}
      </Text>
    </ChangeForm>
  );
}

export function RemoveDialog({ opened, ...props }: RemoveProps & Dialog) {
  return (
    <Modal
      opened={opened}
      onClose={props.onClose}
      title={`Remove the folder ${isolated(props.folder.name)}?`}
      {...close}
    >
      <Remove {...props} />
    </Modal>
  );
}
