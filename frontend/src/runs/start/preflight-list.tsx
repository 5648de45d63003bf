/** List of the pre-flight checks of one engine, in words. */
import { Button, Loader } from "@mantine/core";
import {
  IconAlertTriangle,
  IconCheck,
  IconDownload,
  IconFilePencil,
  IconHandStop,
  IconX,
} from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useEffect, useRef, useState } from "react";
import { Link } from "wouter";
import { errorText } from "../../api/http";
import { fetchInside } from "../../api/inside";
import { CONDUCTED } from "../../api/led-runs";
import { useLive } from "../../api/page-link";
import { serverPath } from "../../api/page-url";
import { useMay } from "../../api/people";
import { type Preflight, type PreflightItem, SIMULATOR } from "../../api/robots";
import { type IndexFolderLook, writeIntoIndex } from "../../api/starts";
import { BatonRemedy } from "../../status/start-remedies";
import { HoldButton } from "../../ui/hold-button";
import { colorOfName } from "../../ui/name-colors";
import { isolated } from "../../words/isolated";
import style from "./preflight-list.module.css";

const WAITING: Readonly<Record<string, string>> = {
  graph: "The graph and its hazards",
  free: "No other run there",
  answers: "An answer to a question asked now",
  proof: "A stop can be proven",
  actions: "Its actions, with the same parameters",
  again: "It survives a start of this name",
  quiet: "Nothing runs that was started elsewhere",
  others: "Nobody else starts things",
  actors: "Whose actions these are",
  courses: "It goes as expected",
};

/** The package with which a robot shows the outputs of actions. */
const VALUES_PACKAGE = "/api/values-package.zip";

const SIGNS = {
  passed: IconCheck,
  warned: IconAlertTriangle,
  blocked: IconX,
  accept: IconHandStop,
} as const;
const READ = {
  passed: "Fine",
  warned: "Note",
  blocked: "In the way",
  accept: "Delays a Stop, to be accepted",
} as const;

/** Items of a led run that make a Stop reach a robot later: a person accepts them, nothing is wrong. */
const DELAYS: ReadonlySet<string> = new Set(["two-at-once", "stop-across"]);

interface PreflightLineProps {
  item: PreflightItem;
  look: Preflight;
  moment: MomentLookedAt;
}

function Line({ item, look, moment }: PreflightLineProps) {
  const verdict = item.overridable && DELAYS.has(item.code) ? "accept" : item.verdict;
  const Sign = SIGNS[verdict];
  return (
    <li className={style.line} data-verdict={verdict}>
      <Sign size={15} stroke={2.4} aria-hidden className={style.sign} />
      <span>
        <span className="visually-hidden">{READ[verdict]}: </span>
        {item.text}
        {item.verdict === "warned" && item.problems.length > 0 && (
          <details className={style.more}>
            <summary>Which</summary>
            <ul>
              {item.problems.map((problem, i) => (
                // biome-ignore lint/suspicious/noArrayIndexKey: a list is replaced as a whole
                <li key={i}>
                  <b>{problem.code}</b> {problem.message}
                </li>
              ))}
            </ul>
          </details>
        )}
        {item.code === "subgraphs" && (
          <IndexWriting item={item} look={look} robot={look.engine} {...moment} />
        )}
        <InsideRemedies item={item} look={look} {...moment} />
        {item.code === "baton" && item.verdict === "blocked" && (
          <BatonRemedy engine={look.engine} onTaken={moment.onLookAgain} />
        )}
        {item.code === "values" && item.verdict === "blocked" && (
          <span className={style.remedies}>
            <a
              className={style.remedy}
              href={serverPath(VALUES_PACKAGE)}
              download="zz_keep_values.zip"
            >
              <IconDownload size={14} aria-hidden /> The package zz_keep_values (ZIP)
            </a>
          </span>
        )}
      </span>
    </li>
  );
}

/** Return a key that stays while other items come and go: several items may have one code. */
function keyOf(items: readonly PreflightItem[], code: string, at: number): string {
  return `${code} ${items.slice(0, at).filter((item) => item.code === code).length}`;
}

interface Props {
  engine: string;
  /** The only engine: its name needs no heading. */
  alone: boolean;
  look: Preflight | undefined;
  moment: MomentLookedAt;
}

export function PreflightList({ engine, alone, look, moment }: Props) {
  const isLed = engine === CONDUCTED;
  const codes = engine === SIMULATOR || isLed ? ["graph"] : Object.keys(WAITING);
  return (
    <div className={style.engine}>
      {!alone && (
        <h4 className={style.name}>
          {!isLed && <i style={{ background: colorOfName(engine) }} aria-hidden />}{" "}
          {isLed ? "The whole graph" : engine}
        </h4>
      )}
      <ul
        className="list-reset"
        aria-label={isLed ? "Looked at in the whole graph" : `Looked at on ${isolated(engine)}`}
      >
        {look
          ? look.items.map((item, i) => (
              <Line key={keyOf(look.items, item.code, i)} item={item} look={look} moment={moment} />
            ))
          : codes.map((code) => (
              <li key={code} className={style.line} data-verdict="waiting">
                <Loader size={13} color="var(--ink3)" className={style.sign ?? ""} />
                {WAITING[code]}
              </li>
            ))}
      </ul>
    </div>
  );
}

const PATIENCE = 20; // seconds; an engine looks every two

interface IndexWritingProps extends MomentLookedAt {
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
      Written, but {isolated(robot)} has not indexed it within {PATIENCE} s. Its engine may read the
      folder only when it starts (<code>--indexing-rate 0</code>): restart the engine. Or it reads
      another folder.
    </span>
  );
}

/** Shows what writing into the index folder would change, before a person confirms it. */
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
            {replaces}, which has another {isolated(graph)}, would be replaced; the old file is kept
            beside it.
          </span>
        ))}
      {names === "" && folder.waiting.length > 0 && (
        <span>
          {folder.waiting.join(", ")} {folder.waiting.length > 1 ? "are" : "is"} in {folder.path}{" "}
          already, and {isolated(robot)} has not indexed it. Its engine may read the folder only
          when it starts: restart the engine.
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
  const label = `Write the graphs where ${isolated(robot)} looks them up`;
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
      question={`Replace ${paths}? A copy of the present state is kept beside it.`}
      disabled={busy}
      onHeld={onWrite}
    />
  );
}

/**
 * Offers to write sub-graphs into the index folder of the robot, if the runner has one; stays open
 * to show the result.
 */
function IndexWriting({ item, look, robot, graph, seq, onLookAgain }: IndexWritingProps) {
  const { runner } = useLive();
  const may = useMay("operate");
  const { folder } = item;
  const write = useMutation({
    mutationFn: async () => {
      const { subgraphs, ...pinned } = await fetchInside(graph, seq);
      if (!subgraphs) throw new Error("The graph has no sub-graphs any more.");
      const replace = (folder?.writable ?? []).flatMap((each) => (each.replaces ? each.graph : []));
      const { digest } = look;
      return writeIntoIndex(runner ?? "", robot, { digest, replace, subgraphs, ...pinned });
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
      {can && !may && <span>Only operators and owners can do that.</span>}
      {write.isError && (
        <span className="ink-error" role="alert">
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

/** The moment that is looked at. */
interface MomentLookedAt {
  readonly graph: string;
  readonly seq: number;
  /** Called when a link leads away, to close the dialog. */
  readonly onLeave: () => void;
  /** Look again, now. */
  readonly onLookAgain: () => void;
}

interface InsideRemediesProps extends MomentLookedAt {
  item: PreflightItem;
  look: Preflight;
}

function Files({ graph, seq }: Omit<MomentLookedAt, "onLeave" | "onLookAgain">) {
  const path = `/api/graphs/${encodeURIComponent(graph)}/subgraphs.zip?at=${seq}`;
  return (
    <a className={style.remedy} href={serverPath(path)} download="graphs_inside.zip">
      <IconDownload size={14} aria-hidden /> Files of the graphs inside (ZIP)
    </a>
  );
}

function OneGraph({ graph, onLeave }: Omit<MomentLookedAt, "seq" | "onLookAgain">) {
  return (
    <Link
      className={style.remedy}
      to={`/graphs/${encodeURIComponent(graph)}?flat`}
      onClick={onLeave}
    >
      Make it one graph
    </Link>
  );
}

/** Remedies for check items that come from sub-graphs; renders nothing for other items. */
function InsideRemedies({ item, look, graph, seq, onLeave }: InsideRemediesProps) {
  if (item.verdict !== "blocked") return null;
  if (item.code === "subgraphs") {
    return (
      <span className={style.remedies}>
        <span>
          Put their files into a package that the robot indexes and restart its engine, or start one
          graph that does the same without graphs inside.
        </span>
        <Files graph={graph} seq={seq} />
        <OneGraph graph={graph} onLeave={onLeave} />
      </span>
    );
  }
  if (item.code === "subgraph-across") {
    return (
      <span className={style.remedies}>
        <OneGraph graph={graph} onLeave={onLeave} />
      </span>
    );
  }
  if (item.code !== "again" || !look.items.some(({ code }) => code === "subgraphs")) return null;
  return (
    <span className={style.remedies}>
      <span>
        One graph that does the same has a name of its own, and no graphs inside that the robot has
        to look up.
      </span>
      <OneGraph graph={graph} onLeave={onLeave} />
    </span>
  );
}
