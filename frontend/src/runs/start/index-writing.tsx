/** Where the runner has the folder that a robot indexes: what it lacks is written there, and waited for. */
import { Button, Loader } from "@mantine/core";
import { IconFilePencil } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { fetchInside } from "../../api/documents/inside";
import { type IndexFolderLook, writeIntoIndex } from "../../api/documents/robot-index";
import { errorText } from "../../api/http";
import { useLive } from "../../api/live/use-live";
import type { Preflight, PreflightItem } from "../../api/robots";
import { useMay } from "../../api/use-person";
import { HoldButton } from "../../ui/floating/hold-button";
import { isolated } from "../../words/isolated";
import type { MomentLookedAt } from "./inside-remedies";
import style from "./preflight-list.module.css";

const PATIENCE = 20; // seconds; an engine looks every two

interface Props extends MomentLookedAt {
  item: PreflightItem;
  look: Preflight;
  robot: string;
}

/** Seconds since something was written that is waited for. Looks again each second until it is too long. */
function useWaiting(isWaiting: boolean, onLookAgain: () => void): number {
  const [seconds, setSeconds] = useState(0);
  const look = useRef(onLookAgain);
  useEffect(() => {
    look.current = onLookAgain;
  });
  const goes = isWaiting && seconds < PATIENCE;
  useEffect(() => {
    if (!goes) return;
    const timer = setInterval(() => {
      setSeconds((so) => so + 1);
      look.current();
    }, 1_000);
    return () => clearInterval(timer);
  }, [goes]);
  return seconds;
}

function Waiting({ robot, seconds }: { robot: string; seconds: number }) {
  if (seconds < PATIENCE)
    return (
      <span>
        <Loader size={12} color="var(--ink3)" /> Written. Waiting until {isolated(robot)} has
        indexed it …<span aria-hidden> {seconds} s</span>
      </span>
    );
  return (
    <span>
      Written, but {isolated(robot)} has not indexed it within {PATIENCE} s. Its engine may look
      only at its start (<code>--indexing-rate 0</code>): restart it. Or it looks in another folder.
    </span>
  );
}

/** What writing would do, before anybody does it. */
function What({ folder, robot }: { folder: IndexFolderLook; robot: string }) {
  const names = folder.writable.map(({ graph }) => isolated(graph)).join(", ");
  const replaced = folder.writable.filter(({ replaces }) => replaces !== "");
  const hindered = Object.entries(folder.hindered);
  return (
    <>
      {hindered.map(([graph, why]) => (
        <span key={graph}>
          {isolated(graph)} cannot be written into {folder.path}. {why}
        </span>
      ))}
      {hindered.length === 0 && names !== "" && (
        <span>
          {names} can be written into {folder.path}. From then on <bdi>{robot}</bdi> refuses{" "}
          {folder.writable.length > 1 ? "them as graphs of their own" : "it as a graph of its own"}.
        </span>
      )}
      {hindered.length === 0 &&
        replaced.map(({ graph, replaces }) => (
          <span key={graph}>
            {replaces}, which has another {isolated(graph)}, would be replaced, and kept beside.
          </span>
        ))}
      {names === "" && folder.waiting.length > 0 && (
        <span>
          {folder.waiting.join(", ")} {folder.waiting.length > 1 ? "are" : "is"} in {folder.path}{" "}
          already, and {isolated(robot)} has not indexed it. Its engine may look only at its start:
          restart it.
        </span>
      )}
    </>
  );
}

interface WriteButtonProps {
  folder: IndexFolderLook;
  robot: string;
  busy: boolean;
  onWrite: () => void;
}

/** The button; where it would replace files it is held, or asks. */
function WriteButton({ folder, robot, busy, onWrite }: WriteButtonProps) {
  const replaced = folder.writable.filter(({ replaces }) => replaces !== "");
  const label = `Write them where ${isolated(robot)} looks them up`;
  const icon = <IconFilePencil size={14} aria-hidden />;
  if (replaced.length === 0)
    return (
      <Button size="compact-sm" leftSection={icon} loading={busy} onClick={onWrite}>
        {label}
      </Button>
    );
  const paths = replaced.map(({ replaces }) => replaces).join(", ");
  return (
    <HoldButton
      size="compact-sm"
      icon={icon}
      label={
        busy
          ? "Writing …"
          : `Hold to write, replacing ${replaced.length === 1 ? "a file" : "files"}`
      }
      name={`${label}, and replace ${paths}`}
      question={`Replace ${paths}? What is there now is kept beside it.`}
      disabled={busy}
      onHeld={onWrite}
    />
  );
}

/** Nothing where the runner has no such folder. Stays until the look is closed, to say how it went. */
export function IndexWriting({ item, look, robot, graph, seq, onLookAgain }: Props) {
  const { runner } = useLive();
  const may = useMay("operate");
  const { folder } = item;
  const write = useMutation({
    mutationFn: async () => {
      const inside = await fetchInside(graph, seq);
      const replace = (folder?.writable ?? []).flatMap((each) => (each.replaces ? each.graph : []));
      return writeIntoIndex(runner ?? "", robot, { digest: look.digest, replace, ...inside });
    },
    onSuccess: onLookAgain,
    onError: onLookAgain,
  });
  const isBlocked = item.verdict === "blocked";
  const seconds = useWaiting(write.isSuccess && isBlocked, onLookAgain);
  if (!isBlocked && !write.isSuccess) return null;
  if (isBlocked && folder === null) return null;
  const can =
    folder !== null && folder.writable.length > 0 && Object.keys(folder.hindered).length === 0;
  return (
    <span className={style.remedies}>
      {folder !== null && !write.isSuccess && <What folder={folder} robot={robot} />}
      {can && may && !write.isSuccess && (
        <WriteButton
          folder={folder}
          robot={robot}
          busy={write.isPending}
          onWrite={() => write.mutate()}
        />
      )}
      {can && !may && <span>Whoever may operate robots can do that.</span>}
      {write.isError && (
        <span className={style.failed} role="alert">
          {errorText(write.error)}
        </span>
      )}
      <span role="status">
        {write.isPending && "Writing …"}
        {write.isSuccess && isBlocked && <Waiting robot={robot} seconds={seconds} />}
        {write.isSuccess && !isBlocked && `Written, and ${isolated(robot)} has indexed it.`}
      </span>
    </span>
  );
}
