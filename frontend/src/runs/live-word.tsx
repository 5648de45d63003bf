/** Whether the page hears the runner, in words. */
import { IconPlugConnectedX } from "@tabler/icons-react";
import { useLive } from "../api/use-live";
import { clock } from "../ui/when";
import style from "./live-word.module.css";

export function LiveWord() {
  const { now } = useLive();
  if (now.link === "live") {
    return (
      <span className={style.word} data-link="live">
        <i aria-hidden /> Live
      </span>
    );
  }
  if (now.link === "connecting")
    return <span className={style.word}>Connecting to the runner …</span>;
  return (
    <span className={style.word} data-link="down" role="status">
      <IconPlugConnectedX size={13} aria-hidden /> Runner unknown since {clock(now.since)}
    </span>
  );
}
