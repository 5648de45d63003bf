/** Whether what is on screen is stored, in words. */
import {
  IconAlertTriangle,
  IconCheck,
  IconCloudOff,
  IconEye,
  IconRefresh,
} from "@tabler/icons-react";
import { useEditorContext } from "../edit-actions/editor-context";
import type { RefusalReason, RoomLink } from "../sync/room-connection";
import { unsavedReason } from "../sync/unsaved-reasons";
import { useLink, useRoom } from "../sync/use-room";
import { Tooltip } from "../ui/floating/tooltip";
import style from "./save-status.module.css";

const whys: Record<RefusalReason, string> = {
  "session-ended": "Signed out",
  "other-person": "Somebody else signed in here",
  forbidden: "View only",
  "no-such-graph": "This graph is gone",
  "other-epoch": "A backup was restored",
  "other-client": "Opening anew",
  differs: "Opening anew",
  full: "This graph is full",
  "not-accepted": "The server refused a change",
  restarting: "The editor restarts",
  "too-slow": "Connection too slow",
  "no-socket": "No connection",
};

export interface SaveStatusText {
  tone: "good" | "busy" | "off" | "bad" | "view";
  words: string;
}

function changes(n: number): string {
  return n === 1 ? "1 change" : `${n} changes`;
}

/** Who may not edit has nothing to save. */
export function saveStatusText(link: RoomLink, mayEdit = true): SaveStatusText {
  if (link.state === "refused") {
    const why = link.why ? whys[link.why] : "Refused";
    const kept = link.unsaved > 0 ? ` · ${changes(link.unsaved)} not saved` : "";
    return { tone: "bad", words: why + kept };
  }
  if (link.state === "live" && link.seq > 0) {
    if (!mayEdit && link.unsaved === 0) return { tone: "view", words: "View only" };
    return link.unsaved === 0
      ? { tone: "good", words: "Saved" }
      : { tone: "busy", words: `Saving ${link.unsaved}` };
  }
  if (link.seq === 0) {
    return link.why === undefined
      ? { tone: "busy", words: "Opening" }
      : { tone: "off", words: whys[link.why] };
  }
  if (link.unsaved === 0) return { tone: "off", words: "Offline" };
  return { tone: "off", words: `Offline with ${changes(link.unsaved)}` };
}

const signs = {
  good: IconCheck,
  busy: IconRefresh,
  off: IconCloudOff,
  bad: IconAlertTriangle,
  view: IconEye,
};

export function SaveStatus() {
  const link = useLink();
  const { room } = useRoom();
  const { mayEdit } = useEditorContext();
  const { tone, words } = saveStatusText(link, mayEdit);
  const Sign = signs[tone];
  const why = unsavedReason(link);
  return (
    <Tooltip label={why ?? ""} disabled={why === null} width={300} onFocus>
      <span
        className={style.saved}
        data-tone={tone}
        role="status"
        tabIndex={why === null ? undefined : 0}
        title={why === null ? `Moment ${link.seq}` : undefined}
      >
        <Sign size={13} stroke={2.6} aria-hidden /> {words}
        {link.state === "refused" && (
          <button type="button" className={style.again} onClick={() => room.reconnect()}>
            Try again
          </button>
        )}
      </span>
    </Tooltip>
  );
}
