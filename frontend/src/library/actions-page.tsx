/** The page of actions: the list at the left and the selected action beside it; a phone shows one of the two. */
import { Button, Group, Modal, Skeleton, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconAlertTriangle, IconArrowLeft, IconBolt } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useMemo, useState } from "react";
import { Link, useLocation, useSearch } from "wouter";
import { deleteGraph, type GraphSummary, refreshLibrary } from "../api/graphs";
import { errorText, Refusal } from "../api/http";
import { createAction, type LibraryAction, useLibrary } from "../api/library";
import { useLive } from "../api/page-link";
import { DeletedGraphs } from "../home/deleted-graphs";
import {
  type RobotAction,
  type RobotsKnowledge,
  takeFromRobot,
  useRobotsKnowledge,
} from "../home/robot-actions";
import { Empty } from "../ui/empty";
import { useIsPhone } from "../ui/hooks";
import { isolated } from "../words/isolated";
import { ActionList } from "./action-list";
import style from "./actions-page.module.css";
import { addressOf, type ListedAction, listedActions } from "./listing";
import { type BarSlots, OpenAction } from "./open-action";
import { UnlistedAction } from "./unlisted-action";

interface NewActionProps {
  /** The suggested name; null while the dialog is closed. */
  name: string | null;
  busy: boolean;
  /** The reason why the action could not be made; empty without one. */
  wrong: string;
  onClose: () => void;
  onMake: (name: string) => void;
}

function NewActionForm({ name: first, busy, wrong, onClose, onMake }: NewActionProps) {
  const [name, setName] = useState(first ?? "");
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (name.trim() !== "") onMake(name.trim());
      }}
    >
      <TextInput
        label="Name"
        description="As a C++ class: CloseValve, LocateObject"
        placeholder="CloseValve"
        value={name}
        error={wrong || undefined}
        data-autofocus
        maxLength={200}
        onFocus={(event) => event.currentTarget.select()}
        onChange={(event) => setName(event.currentTarget.value)}
      />
      <Group justify="flex-end" mt="md">
        <Button onClick={onClose}>Cancel</Button>
        <Button type="submit" variant="filled" loading={busy} disabled={name.trim() === ""}>
          Make it
        </Button>
      </Group>
    </form>
  );
}

function NewActionDialog(props: NewActionProps) {
  return (
    <Modal opened={props.name !== null} onClose={props.onClose} title="New action">
      <NewActionForm {...props} />
    </Modal>
  );
}

interface Props {
  /** The document of the open action; null: none. */
  id: string | null;
  person: { readonly id: string; readonly name: string };
  slots: BarSlots;
  onImport: () => void;
}

const NONE: readonly LibraryAction[] = [];

/**
 * Return the rest of the address: the name of an action without a document, and whether the action
 * is being edited.
 */
function useAddress() {
  const search = useSearch();
  return useMemo(() => {
    const query = new URLSearchParams(search);
    return { name: query.get("name"), editing: query.has("edit") };
  }, [search]);
}

/** Shown while no action is selected. */
function NoSelection({ isEmpty }: { isEmpty: boolean }) {
  return (
    <Empty icon={<IconBolt size={22} />} title={isEmpty ? "No action yet" : "What robots can do"}>
      {isEmpty
        ? "Make an action, import its file, or draw a graph: the actions that it uses are listed here."
        : "Choose an action to see what it takes and gives, where it is used, and its C++ package."}
    </Empty>
  );
}

interface SelectedActionProps extends Props {
  all: readonly ListedAction[];
  isEmpty: boolean;
  knowledge: RobotsKnowledge;
  making: ReturnType<typeof useNewActions>;
}

function SelectedAction({ all, knowledge, making, isEmpty, ...props }: SelectedActionProps) {
  const { id, person, slots } = props;
  const { name, editing } = useAddress();
  const [, go] = useLocation();
  if (id !== null) {
    const known = all.find(({ action }) => action?.document === id)?.action;
    return (
      <OpenAction
        id={id}
        person={person}
        known={known ?? undefined}
        knowledge={knowledge}
        slots={slots}
        editing={editing}
        onEdit={(next) => go(`/actions/${id}${next ? "?edit" : ""}`, { replace: true })}
        onDelete={making.remove}
      />
    );
  }
  const listed = name === null ? undefined : all.find((each) => each.name === name);
  if (listed === undefined) return <NoSelection isEmpty={isEmpty} />;
  return (
    <UnlistedAction
      listed={listed}
      knowledge={knowledge}
      busy={making.busy}
      onAdd={making.add}
      onTake={making.take}
    />
  );
}

export function ActionsPage(props: Props) {
  const library = useLibrary();
  const knowledge = useRobotsKnowledge();
  const data = library.data ?? NONE;
  const all = useMemo(() => listedActions(data, knowledge), [data, knowledge]);
  const making = useNewActions();
  const [asked, setAsked] = useState<string | null>(null);
  const { name } = useAddress();
  const phone = useIsPhone();
  const open = props.id !== null || name !== null;
  const current =
    props.id === null
      ? name && addressOf({ name, action: null })
      : `/actions/${encodeURIComponent(props.id)}`;
  const close = () => {
    setAsked(null);
    making.forget();
  };
  return (
    <main className={style.page} data-open={open || undefined}>
      <aside className={style.left} aria-label="Library" hidden={phone && open}>
        {library.isPending && <Skeleton height={200} m="sm" />}
        {library.isError && (
          <Empty icon={<IconAlertTriangle size={22} />} title="The library could not be loaded">
            {errorText(library.error)}
          </Empty>
        )}
        {library.isSuccess && (
          <ActionList
            actions={all}
            robots={knowledge.robots}
            current={current}
            onNew={setAsked}
            onImport={props.onImport}
            foot={<DeletedGraphs kind="action" />}
          />
        )}
      </aside>
      {(!phone || open) && (
        <div className={`${style.pane} min-w-0 min-h-0 relative bg-panel overflow-y-auto`}>
          {phone && (
            <Button
              component={Link}
              to="/actions"
              variant="subtle"
              className={style.back ?? ""}
              leftSection={<IconArrowLeft size={16} aria-hidden />}
            >
              All actions
            </Button>
          )}
          <SelectedAction
            {...props}
            all={all}
            isEmpty={library.isSuccess && all.length === 0}
            knowledge={knowledge}
            making={making}
          />
        </div>
      )}
      <NewActionDialog
        name={asked}
        busy={making.busy}
        wrong={making.wrong}
        onClose={close}
        onMake={(wanted) => void making.make(wanted).then((made) => made && close())}
      />
    </main>
  );
}

/** Return whether the server refused a name that is taken. */
function isTaken(error: unknown): boolean {
  return error instanceof Refusal && error.details.status === 409;
}

/** Return the functions that add and delete actions, with their state. */
function useNewActions() {
  const client = useQueryClient();
  const { runner } = useLive();
  const [, go] = useLocation();
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  /** Makes and opens an action. Returns the reason for a failure, or an empty text. */
  const make = async (work: () => Promise<GraphSummary>, editing: boolean): Promise<string> => {
    setBusy(true);
    try {
      const { id } = await work();
      await refreshLibrary(client);
      go(`/actions/${id}${editing ? "?edit" : ""}`);
      return "";
    } catch (error) {
      return isTaken(error) ? "The library has an action of this name." : errorText(error);
    } finally {
      setBusy(false);
    }
  };
  const told = async (work: () => Promise<GraphSummary>) => {
    const message = await make(work, false);
    if (message !== "") notifications.show({ color: "red", title: "Not added", message });
  };
  const ask = async (name: string): Promise<boolean> => {
    const reason = await make(() => createAction(name), true);
    setWrong(reason);
    return reason === "";
  };
  const remove = async (id: string, name: string) => {
    try {
      await deleteGraph(id);
      notifications.show({
        title: `${isolated(name)} is deleted from the library`,
        message: "Graphs that use it do not change. You can restore it below the list.",
      });
      go("/actions");
    } catch (error) {
      notifications.show({ color: "red", title: "Not deleted", message: errorText(error) });
    } finally {
      await refreshLibrary(client);
    }
  };
  return {
    busy,
    wrong,
    make: ask,
    add: (name: string) => void told(() => createAction(name, true)),
    take: (has: RobotAction) => void told(() => takeFromRobot(runner, has)),
    remove: (id: string, name: string) => void remove(id, name),
    forget: () => setWrong(""),
  };
}
