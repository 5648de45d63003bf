/** An open action of the library, which several people can read and edit at once. */

import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconMapOff } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { type ReactNode, useEffect, useRef, useState } from "react";
import { createPortal } from "react-dom";
import { Link } from "wouter";
import { refreshLibrary } from "../api/graphs";
import { errorText } from "../api/http";
import { type LibraryAction, takeFromGraph } from "../api/library";
import { usePackagesAt } from "../api/packages";
import { useMay } from "../api/people";
import { EditorStoreProvider } from "../canvas/editor-store";
import { redo, undo } from "../edit-actions/all";
import { editActionFor, isEnabled } from "../edit-actions/edit-action";
import { type EditorContext, EditorReactContext } from "../edit-actions/editor-context";
import { useProblemGroups } from "../editor/problem-count";
import { RoomNotices } from "../editor/room-notices";
import { SaveStatus } from "../editor/save-status";
import { useEditor } from "../editor/use-editor";
import type { Action } from "../graph/model";
import { type RobotAction, type RobotsKnowledge, robotDifferences } from "../home/robot-actions";
import { LibraryActionForm } from "../inspector/action-form";
import { fieldOfGroup } from "../inspector/fields/field-problems";
import { graphLabels } from "../inspector/labels";
import { People } from "../people/people";
import { roomUrl } from "../sync/room-connection";
import { RoomProvider, useLinkPart, useThrottledLink } from "../sync/use-room";
import { Empty } from "../ui/empty";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { isolated } from "../words/isolated";
import { ActionHead } from "./action-head";
import { ActionOverview, OnRobots, UsedIn } from "./action-overview";
import style from "./open-action.module.css";
import { SidePane } from "./side-pane";

const TYPING = "input, textarea, select, [role=dialog], [role=menu]";

function useUndoKeys(context: EditorContext): void {
  const now = useRef(context);
  now.current = context;
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      if (event.target instanceof Element && event.target.closest(TYPING) !== null) return;
      const editAction = editActionFor([undo, redo], event, false);
      if (editAction === null || !isEnabled(editAction, now.current)) return;
      event.preventDefault();
      editAction.run(now.current);
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
}

interface NamesLineProps {
  id: string;
  seq: number;
  name: string;
}

function NamesLine({ id, seq, name }: NamesLineProps) {
  const list = usePackagesAt(id, seq).data;
  const outline = list?.packages.find(({ action }) => action === name);
  if (outline !== undefined) {
    return (
      <p className={style.names}>
        Package <code className="mono">{outline.package}</code> · class{" "}
        <code className="mono">{name}</code> · library{" "}
        <code className="mono">lib{outline.package}.so</code>
      </p>
    );
  }
  const reasons = (list?.refusals ?? []).filter(({ place }) => place === name);
  return reasons.map(({ reason }) => (
    <p key={reason} className={style.names} data-wrong>
      No C++ package: {reason}
    </p>
  ));
}

const TakeOverDialog = lazyPart(() =>
  import("./take-over-dialog").then((part) => part.TakeOverDialog),
);

interface TakeOverProps {
  /** The id of the action's document. */
  id: string;
  has: RobotAction;
}

function TakeOver({ id, has }: TakeOverProps) {
  // Null until it is opened; from then on the dialog stays mounted, so that it can return the
  // focus.
  const [open, setOpen] = useState<boolean | null>(null);
  return (
    <>
      <Button size="compact-sm" variant="subtle" onClick={() => setOpen(true)}>
        Take over from <bdi>{has.robot}</bdi>
      </Button>
      <OverlayBoundary>
        {open !== null && (
          <TakeOverDialog id={id} has={has} opened={open} onClose={() => setOpen(false)} />
        )}
      </OverlayBoundary>
    </>
  );
}

const UpdateDialog = lazyPart(() => import("./update-dialog").then((part) => part.UpdateDialog));

interface OlderUsesProps {
  id: string;
  name: string;
  count: number;
}

function OlderUses({ id, name, count }: OlderUsesProps) {
  const mayEdit = useMay("edit");
  // Null until it is opened; from then on the dialog stays mounted, so that it can return the
  // focus.
  const [open, setOpen] = useState<boolean | null>(null);
  return (
    <section className={style.notice} aria-label="Older parameters" hidden={count === 0}>
      <p>
        {count === 1
          ? "1 graph still uses the older parameters."
          : `${count} graphs still use the older parameters.`}
      </p>
      <Button className={style.tool ?? ""} onClick={() => setOpen(true)}>
        {mayEdit ? "Look and update" : "Look"}
      </Button>
      <OverlayBoundary>
        {open !== null && (
          <UpdateDialog
            id={id}
            name={name}
            mayEdit={mayEdit}
            opened={open}
            onClose={() => setOpen(false)}
          />
        )}
      </OverlayBoundary>
    </section>
  );
}

/** Elements in the top bar that stay when another action is opened. */
export interface BarSlots {
  readonly status: HTMLElement | null;
  readonly people: HTMLElement | null;
}

interface Props {
  id: string;
  person: { readonly id: string; readonly name: string };
  /** The action in the list of the library; undefined while that loads. */
  known: LibraryAction | undefined;
  knowledge: RobotsKnowledge;
  slots: BarSlots;
  editing: boolean;
  onEdit: (editing: boolean) => void;
  onDelete: (id: string, name: string) => void;
}

const noPanel = () => {};

/** Return the problems of the action without missing values: values belong to its uses in graphs. */
function useTold({ id, graph }: EditorContext, seq: number) {
  const { told } = useProblemGroups(id, seq, graph);
  return told.filter((each) => each.kind !== "fill-in" && fieldOfGroup(each) !== null);
}

/** Refreshes the library as soon as an edit of this action is stored. */
function useFreshLibrary(seq: number, unsaved: number): void {
  const client = useQueryClient();
  const [opened] = useState(seq);
  useEffect(() => {
    if (seq > opened && unsaved === 0) void refreshLibrary(client);
  }, [client, seq, unsaved, opened]);
}

function UsesAndRobots({ known, action, knowledge, context }: UsesAndRobotsProps) {
  const client = useQueryClient();
  const take = async (graph: string, name: string) => {
    try {
      await takeFromGraph(context.id, graph);
      notifications.show({
        message: `The library now has the definition of ${isolated(name)}. Its history can restore the earlier one.`,
      });
    } catch (error) {
      notifications.show({ color: "red", title: "Not taken over", message: errorText(error) });
    } finally {
      await refreshLibrary(client);
    }
  };
  return (
    <>
      <UsedIn
        usedIn={known?.used_in ?? []}
        differs={known?.differs_in ?? []}
        {...(context.mayEdit && {
          onTake: (graph: string, name: string) => void take(graph, name),
        })}
      />
      <OnRobots
        name={action.name}
        knowledge={knowledge}
        own={known ?? null}
        offer={(has) =>
          context.mayEdit &&
          known !== undefined &&
          robotDifferences(known, has.action).length > 0 && <TakeOver id={context.id} has={has} />
        }
      />
    </>
  );
}

interface UsesAndRobotsProps extends Pick<Props, "known" | "knowledge"> {
  action: Action;
  context: EditorContext;
}

function Body(props: Props & { action: Action; context: EditorContext; seq: number }) {
  const { action, context, seq, known, id, editing } = props;
  const told = useTold(context, seq);
  return (
    <div className={style.inner}>
      <ActionHead
        name={action.name}
        editing={editing && context.mayEdit}
        onEdit={props.onEdit}
        onDelete={() => props.onDelete(id, action.name)}
      />
      {known && <OlderUses id={id} name={action.name} count={known.differs_in.length} />}
      {editing && context.mayEdit ? (
        <div className={style.form}>
          <LibraryActionForm
            key={action.key}
            action={action}
            told={told}
            names={<NamesLine id={id} seq={seq} name={action.name} />}
          />
        </div>
      ) : (
        <ActionOverview {...action} labels={graphLabels(context.graph)}>
          <UsesAndRobots {...props} />
        </ActionOverview>
      )}
    </div>
  );
}

function OpenedAction(props: Props) {
  const { id, person, slots } = props;
  const { context } = useEditor(id, noPanel);
  const { seq, unsaved } = useThrottledLink();
  const gone = useLinkPart(
    (link) => link.state === "refused" && link.why === "no-such-graph" && link.seq === 0,
  );
  useUndoKeys(context);
  useFreshLibrary(seq, unsaved);
  const action = context.graph.actions.find(({ missing }) => !missing);
  const inSlot = (slot: HTMLElement | null, part: ReactNode) => slot && createPortal(part, slot);
  if (gone) return <MissingAction />;
  return (
    <EditorReactContext value={context}>
      {inSlot(slots.status, <SaveStatus />)}
      {inSlot(slots.people, <People me={person.id} />)}
      <div className={style.opened}>
        <section className={style.middle} aria-label={action?.name ?? "Action"}>
          {seq === 0 && <Skeleton height={180} />}
          {seq > 0 && action === undefined && <p role="status">It holds no action.</p>}
          {action && <Body {...props} action={action} context={context} seq={seq} />}
        </section>
        <aside className={style.beside} aria-label="Package, comments and history">
          <SidePane id={id} action={action} seq={seq} mayEdit={context.mayEdit} />
        </aside>
      </div>
      <RoomNotices />
    </EditorReactContext>
  );
}

function MissingAction() {
  return (
    <Empty
      icon={<IconMapOff size={22} />}
      title="There is no such action"
      action={
        <Button component={Link} to="/actions">
          All actions
        </Button>
      }
    >
      It was deleted, or the address belongs to another server.
    </Empty>
  );
}

export function OpenAction(props: Props) {
  const { id, person } = props;
  return (
    <RoomProvider
      url={roomUrl(id)}
      keep={{ graph: id, person }}
      fallback={<Skeleton height={180} m="lg" />}
    >
      <EditorStoreProvider key={id}>
        <OpenedAction {...props} />
      </EditorStoreProvider>
    </RoomProvider>
  );
}
