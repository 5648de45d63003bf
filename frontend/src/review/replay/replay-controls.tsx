/** The controls of a replay: scrub, play, step, speed. */
import { ActionIcon, Button, Loader, NativeSelect, Slider } from "@mantine/core";
import {
  IconPlayerPauseFilled,
  IconPlayerPlayFilled,
  IconPlayerSkipBack,
  IconPlayerTrackNext,
  IconPlayerTrackPrev,
} from "@tabler/icons-react";
import { type ReactNode, useEffect, useRef } from "react";
import { Tooltip } from "../../ui/floating/tooltip";
import { keyOf } from "../../ui/keys";
import { duration } from "../../ui/times";
import style from "./replay-controls.module.css";
import { REPLAY_SPEEDS, type ReplayCursor } from "./use-replay";

interface Props {
  replay: ReplayCursor;
  goes: boolean;
  /** What can be done at the moment where it stands. */
  children?: ReactNode;
}

/** Space plays, arrows step, Home and End go to the ends: wherever nobody is typing. */
function usePlayerKeys(replay: ReplayCursor): void {
  const now = useRef(replay);
  now.current = replay;
  useEffect(() => {
    const onKey = (event: KeyboardEvent) => {
      const typed =
        "input, textarea, select, [role=slider], [role=tab], [role=dialog], [role=menu]";
      const key = keyOf(event);
      const own = key === " " ? `button, a, ${typed}` : typed;
      const taken = event.target instanceof HTMLElement && event.target.closest(own) !== null;
      if (taken || event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
      const { seek, play, step, playing, start } = now.current;
      const handler = new Map<string, () => void>([
        [" ", () => play(!playing)],
        ["ArrowRight", () => step(1)],
        ["ArrowLeft", () => step(-1)],
        ["Home", () => seek(start)],
        ["End", () => seek(null)],
      ]).get(key);
      if (handler === undefined) return;
      event.preventDefault();
      handler();
    };
    window.addEventListener("keydown", onKey);
    return () => window.removeEventListener("keydown", onKey);
  }, []);
}

export function PlayerControls({ replay, goes, children }: Props) {
  const { at, start, end, playing, speed, seek, play, step } = replay;
  usePlayerKeys(replay);
  const here = at ?? end;
  const span = Math.max(1, end - start);
  const live = goes && at === null;
  return (
    <section className={style.player} aria-label="Replay">
      <Tooltip label="To the start (Home)">
        <ActionIcon aria-label="To the start" onClick={() => seek(start)}>
          <IconPlayerSkipBack size={16} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Tooltip label="The change before (←)">
        <ActionIcon aria-label="The change before" onClick={() => step(-1)}>
          <IconPlayerTrackPrev size={16} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Tooltip label={playing ? "Pause (Space)" : "Play (Space)"}>
        <ActionIcon
          variant="filled"
          className={style.play ?? ""}
          aria-label={playing ? "Pause the replay" : "Play the replay"}
          onClick={() => play(!playing)}
        >
          {playing ? (
            <IconPlayerPauseFilled size={15} aria-hidden />
          ) : (
            <IconPlayerPlayFilled size={15} aria-hidden />
          )}
        </ActionIcon>
      </Tooltip>
      <Tooltip label="The next change (→)">
        <ActionIcon aria-label="The next change" disabled={at === null} onClick={() => step(1)}>
          <IconPlayerTrackNext size={16} aria-hidden />
        </ActionIcon>
      </Tooltip>
      <Slider
        className={style.slider ?? ""}
        size="sm"
        label={null}
        thumbLabel="Moment of the run"
        min={0}
        max={span}
        step={Math.max(1, span / 1000)}
        value={Math.min(span, Math.max(0, here - start))}
        onChange={(value) => seek(start + value)}
      />
      <span className={style.time} data-testid="replay-time">
        {replay.waiting ? <Loader size={12} aria-label="Loading the replay" /> : null}
        <b>{duration(Math.max(0, here - start))}</b> / {duration(span)}
      </span>
      <NativeSelect
        className={style.speed ?? ""}
        size="xs"
        aria-label="Speed of the replay"
        value={String(speed)}
        onChange={(event) => replay.setSpeed(Number(event.currentTarget.value))}
        data={REPLAY_SPEEDS.map((each) => ({ value: String(each), label: `${each}×` }))}
      />
      <Button
        className={style.edge ?? ""}
        size="compact-xs"
        variant={at === null ? "light" : "subtle"}
        aria-pressed={at === null}
        onClick={() => seek(null)}
      >
        {goes ? (live ? "Live" : "Back to live") : "End"}
      </Button>
      {children}
    </section>
  );
}
