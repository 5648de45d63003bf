/** Shows in words whether everything on screen is stored. */

import {
  IconAlertTriangle,
  IconCheck,
  IconCloudOff,
  IconEye,
  IconPencil,
  IconRefresh,
} from "@tabler/icons-react";
import { useSyncExternalStore } from "react";
import { usePerson } from "../api/people";
import { useEditorContext } from "../edit-actions/editor-context";
import type { RefusalReason, RoomLink } from "../sync/room-connection";
import { unsavedReason } from "../sync/unsaved-reasons";
import { useLink, useRoom } from "../sync/use-room";
import { type DraftCounts, pendingDrafts } from "../ui/drafts";
import { textScope, useWaitingTexts } from "../ui/kept-texts";
import { Tooltip } from "../ui/tooltip";
import { counted } from "../words/counted";
import style from "./save-status.module.css";

const whys: Record<RefusalReason, string> = {
  "session-ended": "Signed out",
  "other-person": "Somebody else signed in here",
  forbidden: "View only",
  "no-such-graph": "This graph is gone",
  "other-epoch": "A backup was restored",
  "other-client": "Reloading",
  differs: "Reloading",
  full: "This graph is full",
  "not-accepted": "The server refused a change",
  restarting: "The editor restarts",
  "too-slow": "Connection too slow",
  "no-network": "Offline",
  proxy: "Proxy error",
  "not-stored": "Server cannot store",
  "no-socket": "No connection",
};

export interface SaveStatusText {
  tone: "good" | "busy" | "off" | "bad" | "view" | "draft";
  words: string;
}

const NO_DRAFTS: DraftCounts = { writing: 0, waiting: 0 };

/**
 * Return the status. People who may not edit have nothing to save; text in a field that is not yet
 * in the graph counts as unsaved.
 */
export function saveStatusText(
  room: RoomLink,
  mayEdit = true,
  { writing, waiting }: DraftCounts = NO_DRAFTS,
): SaveStatusText {
  const link = { ...room, unsaved: room.unsaved + writing };
  if (link.state === "refused") {
    const why = link.why ? whys[link.why] : "Refused";
    const kept = link.unsaved > 0 ? ` · ${counted(link.unsaved, "change")} not saved` : "";
    return { tone: "bad", words: why + kept };
  }
  if (link.state === "live" && link.seq > 0) {
    if (!mayEdit && link.unsaved === 0) return { tone: "view", words: "View only" };
    if (link.unsaved > 0) return { tone: "busy", words: `Saving ${link.unsaved}` };
    return waiting === 0
      ? { tone: "good", words: "Saved" }
      : { tone: "draft", words: `${counted(waiting, "draft")} not saved` };
  }
  if (link.seq === 0) {
    return link.why === undefined
      ? { tone: "busy", words: "Opening" }
      : { tone: "off", words: whys[link.why] };
  }
  const state = link.why === undefined ? "Server away" : whys[link.why];
  if (link.unsaved === 0) return { tone: "off", words: state };
  const joint = link.why === "not-stored" ? "" : " with";
  return { tone: "off", words: `${state}${joint} ${counted(link.unsaved, "change")}` };
}

const signs = {
  good: IconCheck,
  busy: IconRefresh,
  off: IconCloudOff,
  bad: IconAlertTriangle,
  view: IconEye,
  draft: IconPencil,
};

const DRAFTS_WHY =
  "What you typed is not in the graph yet: press Enter or leave its field, press its button, or mend what is not valid.";

/** Return the number of drafts on this page that are not written to this graph. */
function useDraftCounts(): DraftCounts {
  const { id } = useEditorContext();
  const { person } = usePerson();
  const { writing, waiting } = useSyncExternalStore(pendingDrafts.onChange, pendingDrafts.counts);
  const texts = useWaitingTexts(textScope(id, person.id));
  return { writing, waiting: waiting + texts };
}

export function SaveStatus() {
  const link = useLink();
  const { room } = useRoom();
  const { mayEdit } = useEditorContext();
  const drafts = useDraftCounts();
  const { tone, words } = saveStatusText(link, mayEdit, drafts);
  const Sign = signs[tone];
  const why = unsavedReason(link) ?? (drafts.waiting > 0 ? DRAFTS_WHY : null);
  return (
    <Tooltip label={why ?? ""} disabled={why === null} width={300} onFocus>
      <span
        className={style.saved}
        data-tone={tone}
        role="status"
        tabIndex={why === null ? undefined : 0}
        title={why === null ? `Moment ${link.seq}` : undefined}
      >
        <Sign size={13} stroke={2.6} aria-hidden /> <span>{words}</span>
        {link.state === "refused" && (
          <button type="button" className={style.again} onClick={() => room.reconnect()}>
            Try again
          </button>
        )}
      </span>
    </Tooltip>
  );
}
