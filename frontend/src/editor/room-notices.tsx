/** Notices over the canvas about this person's edits and the connection, each with what the person can do. */
import { Button, CloseButton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconArchive,
  IconDatabaseOff,
  IconHistory,
  IconInfoCircle,
  IconLock,
  IconUsers,
} from "@tabler/icons-react";
import { useCallback, useEffect, useState } from "react";
import { Link } from "wouter";
import { useMay } from "../api/people";
import { MOST_VALUE_BYTES, onTooLarge } from "../graph/edit/edit-size";
import type { ConnectionNotice } from "../sync/graph-connection";
import { otherPeopleWait } from "../sync/unsaved-reasons";
import {
  useChangedTwice,
  useGraphPart,
  useLinkPart,
  useMyName,
  useNotice,
  useOthersWaiting,
  useRoom,
  useStrandedEdits,
} from "../sync/use-room";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { Notice } from "./room-notice";
import style from "./room-notices.module.css";

const ChangedTwiceNotice = lazyPart(() =>
  import("./changed-twice").then((part) => part.ChangedTwiceNotice),
);
const OthersDialog = lazyPart(() => import("./stranded-edits").then((part) => part.OthersDialog));
const StrandedEditsDialog = lazyPart(() =>
  import("./stranded-edits").then((part) => part.StrandedEditsDialog),
);

const words: Record<ConnectionNotice, string> = {
  "went-back":
    "A backup was restored: the page shows the graph as the server has it now. You had no unsaved changes.",
  differed:
    "This page differed from the server, so it was loaded again. The fault was reported; none of your changes is lost.",
};

/** Tells why nobody can change this graph, and what to do about it. */
function ReadOnly() {
  const readOnly = useLinkPart((link) => link.readOnly);
  if (readOnly === undefined) return null;
  return (
    <Notice icon={<IconLock size={16} />} tone="warn">
      {readOnly}{" "}
      {readOnly.includes("is damaged") ? (
        <>
          The page shows the graph as it was before that; you can download and run it. The
          administrator of the server can check it with <code>action-assistant verify</code> and
          restore a backup with <code>restore</code>.
        </>
      ) : (
        "An owner can change that."
      )}
    </Notice>
  );
}

/** Tells that the server answers, and cannot store: to owners also why, and where to look. */
function NotStored() {
  const why = useLinkPart((link) => (link.state === "live" ? undefined : link.why));
  const said = useLinkPart((link) => link.said);
  const waits = useLinkPart((link) => link.unsaved > 0);
  const owns = useMay("restore");
  if (why !== "not-stored") return null;
  return (
    <Notice icon={<IconDatabaseOff size={16} />} tone="warn">
      The server cannot store anything at the moment.{" "}
      {waits ? "Your changes wait here, and are sent when it can." : "What you change waits here."}
      {owns && (
        <>
          {" "}
          {said} See <Link to="/admin">Administration</Link>.
        </>
      )}
    </Notice>
  );
}

function OthersNotice() {
  const waiting = useOthersWaiting();
  const graph = useGraphPart(({ name }) => name);
  const [opened, setOpened] = useState<boolean | null>(null);
  const said = otherPeopleWait(waiting.others);
  if (said === null) return null;
  return (
    <Notice
      icon={<IconUsers size={16} />}
      action={
        <Button size="compact-sm" onClick={() => setOpened(true)}>
          Look
        </Button>
      }
    >
      {said}
      <OverlayBoundary>
        {opened !== null && (
          <OthersDialog
            graph={graph}
            waiting={waiting}
            opened={opened}
            onClose={() => setOpened(false)}
          />
        )}
      </OverlayBoundary>
    </Notice>
  );
}

/** Shows the notice about fields that this person and others changed while this person was offline. */
function ChangedByBoth() {
  const all = useChangedTwice();
  if (all.length === 0) return null;
  return (
    <OverlayBoundary>
      <ChangedTwiceNotice all={all} />
    </OverlayBoundary>
  );
}

/**
 * Return the state of the dialog for edits that the server did not take. It opens for each new set
 * of edits until the person postpones it.
 */
function useStrandedEditsDialog() {
  const choice = useStrandedEdits();
  const [later, setLater] = useState(false);
  // biome-ignore lint/correctness/useExhaustiveDependencies: another choice is asked about anew
  useEffect(() => setLater(false), [choice?.stranded]);
  return {
    any: choice !== null,
    edits: choice?.stranded.edits ?? 0,
    cause:
      choice?.stranded.refused === undefined
        ? "since a backup was restored"
        : "since the server did not take it",
    waits: choice !== null && later,
    open: !later,
    putOff: useCallback(() => setLater(true), []),
    takeUp: useCallback(() => setLater(false), []),
  };
}

/** Tells that an edit was refused because a value is too large. */
function useTooLargeNotice(): void {
  const { doc } = useRoom();
  useEffect(
    () =>
      onTooLarge(doc, (bytes) => {
        notifications.show({
          color: "red",
          autoClose: 12_000,
          title: "Nothing was changed",
          message: `One value has ${mib(bytes)} MiB, and ${mib(MOST_VALUE_BYTES)} MiB is the most that can be stored.`,
        });
      }),
    [doc],
  );
}

const mib = (bytes: number) => (bytes / 2 ** 20).toFixed(2);

export function RoomNotices() {
  useTooLargeNotice();
  const by = useMyName();
  const said = useNotice();
  const choosing = useStrandedEditsDialog();
  return (
    <>
      <div className={style.notices} role="status" data-room-notices>
        <ReadOnly />
        <NotStored />
        {said && (
          <Notice
            icon={
              said.notice === "went-back" ? <IconHistory size={16} /> : <IconInfoCircle size={16} />
            }
            action={<CloseButton aria-label="Close the note" onClick={said.dismiss} />}
          >
            {words[said.notice]}
          </Notice>
        )}
        {choosing.waits && (
          <Notice
            icon={<IconArchive size={16} />}
            tone="warn"
            action={
              <Button size="compact-sm" onClick={choosing.takeUp}>
                Decide
              </Button>
            }
          >
            {choosing.edits === 1 ? "1 edit waits" : `${choosing.edits} edits wait`} for your
            decision, {choosing.cause}.
          </Notice>
        )}
        <ChangedByBoth />
        <OthersNotice />
      </div>
      <OverlayBoundary>
        {choosing.any && (
          <StrandedEditsDialog by={by} open={choosing.open} onLater={choosing.putOff} />
        )}
      </OverlayBoundary>
    </>
  );
}
