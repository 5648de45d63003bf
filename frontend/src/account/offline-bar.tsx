/** Says that no server has answered since the page was opened, and what that means for robots. */
import { IconPlugConnectedX } from "@tabler/icons-react";
import { useRootMark } from "../ui/hooks/use-root-mark";
import style from "./offline-bar.module.css";

export function OfflineBar() {
  useRootMark("data-offline", true);
  return (
    <p className={style.bar} role="status">
      <IconPlugConnectedX size={18} aria-hidden />
      <span>
        <b>Offline: this is what this device keeps.</b> Robots cannot be started or stopped from
        here now; use the hardware stop. Edits wait on this device until the server answers.
      </span>
    </p>
  );
}
