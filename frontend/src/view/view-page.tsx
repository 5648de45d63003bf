/** The page of a link: one graph or one run, to be looked at. It has no menus, no session and no STOP. */
import { CloseButton, Loader } from "@mantine/core";
import { IconEye, IconLinkOff, IconPlugConnectedX } from "@tabler/icons-react";
import { ReactFlowProvider, useReactFlow, useStore } from "@xyflow/react";
import { memo, type ReactNode, useEffect, useMemo, useRef, useState } from "react";
import type { Run } from "../api/run-stop";
import { runPlace } from "../api/runs";
import { fromUmrf } from "../canvas/from-umrf";
import { GraphView } from "../canvas/graph-view";
import { serverTimeOf } from "../clock/server-clock";
import { type Action, fullName, type Graph, type Key } from "../graph/model";
import { lanesOf } from "../status/lanes/lanes";
import { Timeline } from "../status/lanes/timeline";
import { runEndText, runLabel, runStatus } from "../status/progress";
import { useProgress } from "../status/progress-inside";
import { StateLabel } from "../status/state-label";
import { withWaits } from "../status/waits";
import { Empty } from "../ui/empty";
import { clock, duration, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import {
  type Shared,
  type SharedGraph,
  type SharedRun,
  useSharedGraph,
  useSharedRun,
  viewKeyIn,
} from "./shared-things";
import style from "./view-page.module.css";

const NO_LINK = "This address has no whole link. Ask for the link again, and copy all of it.";
const QUIET = 3_000; // ms: an engine that has shown a run since then is heard
const NO_PROGRESS = new Map<Key, never>();

export function ViewPage() {
  const [key, setKey] = useState(() => viewKeyIn(location.hash));
  useEffect(() => {
    const take = () => setKey(viewKeyIn(location.hash));
    window.addEventListener("hashchange", take);
    return () => window.removeEventListener("hashchange", take);
  }, []);
  if (key === null) return <Refused why={NO_LINK} />;
  return key.kind === "graph" ? (
    <GraphOfLink key={key.text} text={key.text} />
  ) : (
    <RunOfLink key={key.text} text={key.text} />
  );
}

function Refused({ why }: { why: string }) {
  return (
    <main className={style.page}>
      <Empty icon={<IconLinkOff size={22} />} title="This link shows nothing">
        {why}
      </Empty>
    </main>
  );
}

/** `why`: the reason why nothing has come yet; "" while nothing speaks against it. */
function Waiting({ why }: { why: string }) {
  return (
    <main className={style.page} aria-busy="true">
      <div className={style.waiting} role="status">
        <Loader aria-label="Loading" />
        {why !== "" && <p className="m-0">{isolated(why)} Trying again.</p>}
      </div>
    </main>
  );
}

interface FrameProps {
  title: string;
  status?: ReactNode;
  lost: number | null;
  /** Says where the things are done that this page does not do. */
  note: string;
  children: ReactNode;
}

function Frame({ title, status, lost, note, children }: FrameProps) {
  useEffect(() => {
    document.title = `${isolated(title)} · TeMoto Action Assistant`;
  }, [title]);
  return (
    <main className={style.page}>
      <header className={style.head}>
        <h1 className={style.title}>{title}</h1>
        {status}
      </header>
      {lost !== null && (
        <p className={style.lost} role="alert">
          <IconPlugConnectedX size={16} aria-hidden />
          The server does not answer since {clock(serverTimeOf(lost))}. What is shown is from then.
        </p>
      )}
      {children}
      <footer className={style.foot}>
        <IconEye size={15} aria-hidden />
        <span>
          <b>Looking only.</b> {note}
        </span>
      </footer>
    </main>
  );
}

/** The page is drawn with time, the canvas only with what changes on it. */
const Canvas = memo(function Canvas(props: Parameters<typeof GraphView>[0]) {
  const [isMoved, setMoved] = useState(false);
  return (
    <ReactFlowProvider>
      <GraphView {...props} onPanned={() => setMoved(true)}>
        {!isMoved && <FitAgain />}
      </GraphView>
    </ReactFlowProvider>
  );
});

/** Fits the graph again when a phone is turned, or the frame around the page becomes larger or smaller. */
function FitAgain() {
  const { fitView } = useReactFlow();
  const size = useStore(({ width, height }) => `${width} ${height}`);
  const fitted = useRef(size);
  useEffect(() => {
    if (fitted.current === size) return;
    fitted.current = size;
    void fitView({ maxZoom: 1, padding: 0.12 });
  }, [size, fitView]);
  return null;
}

function GraphOfLink({ text }: { text: string }) {
  const shared = useSharedGraph(text);
  return <Seen shared={shared}>{(thing, lost) => <GraphSeen thing={thing} lost={lost} />}</Seen>;
}

function RunOfLink({ text }: { text: string }) {
  const shared = useSharedRun(text);
  return <Seen shared={shared}>{(thing, lost) => <RunSeen thing={thing} lost={lost} />}</Seen>;
}

interface SeenProps<T> {
  shared: Shared<T>;
  children: (thing: T, lost: number | null) => ReactNode;
}

function Seen<T>({ shared, children }: SeenProps<T>) {
  if (shared.at === "loading") return <Waiting why={shared.why} />;
  if (shared.at === "refused") return <Refused why={shared.why} />;
  return children(shared.thing, shared.lost);
}

function GraphSeen({ thing, lost }: { thing: SharedGraph; lost: number | null }) {
  // A graph that did not change is drawn as it is, so that nobody loses their place.
  const written = JSON.stringify(thing.umrf);
  const graph = useMemo(() => fromUmrf(JSON.parse(written)), [written]);
  const [picked, pick] = useState<Key | null>(null);
  const selected = useMemo(() => new Set(picked === null ? [] : [picked]), [picked]);
  const action = graph.actions.find(({ key }) => key === picked);
  const { problems } = thing;
  return (
    <Frame
      title={graph.name || "Graph"}
      status={<span className="ink3 text-12">{counted(problems.length, "problem")}</span>}
      lost={lost}
      note="Nothing can be changed or started here."
    >
      <section className={style.canvas} aria-label="Graph">
        <Canvas
          graph={graph}
          progress={NO_PROGRESS}
          selected={selected}
          onSelect={pick}
          label={isolated(graph.name)}
        />
      </section>
      <aside className={style.side} aria-label="Details">
        {action ? (
          <ActionFacts action={action} onClose={() => pick(null)} />
        ) : (
          <>
            {graph.description !== "" && <p className="m-0 text-13">{graph.description}</p>}
            <ul className={style.actions} aria-label="Actions">
              {graph.actions.map((each) => (
                <li key={each.key}>
                  <button type="button" className={style.problem} onClick={() => pick(each.key)}>
                    {fullName(each)}
                  </button>
                </li>
              ))}
            </ul>
          </>
        )}
        {problems.length > 0 && (
          <ul className={style.problems} aria-label="Problems of this graph alone">
            {problems.map(({ code, message, where: { aid = null, path = "" } }) => (
              <li key={`${code} ${aid} ${path} ${message}`}>
                {isOnGraph(graph, aid) ? (
                  <button type="button" className={style.problem} onClick={() => pick(aid)}>
                    {message}
                  </button>
                ) : (
                  message
                )}
              </li>
            ))}
          </ul>
        )}
      </aside>
    </Frame>
  );
}

function isOnGraph(graph: Graph, place: string | null): boolean {
  return graph.actions.some(({ key }) => key === place);
}

function ActionFacts({ action, onClose }: { action: Action; onClose: () => void }) {
  return (
    <div className="stack gap-50">
      <div className="row justify-between gap-50">
        <h2 className="m-0 text-13 weight-650 break-anywhere">{fullName(action)}</h2>
        <CloseButton aria-label="All actions" onClick={onClose} />
      </div>
      <p className="m-0 ink3 text-12">
        <bdi>{action.type}</bdi>
        {action.actor !== "" && ` · ${isolated(action.actor)}`}
      </p>
      {action.description !== "" && <p className="m-0 text-13">{action.description}</p>}
      <Values title="Parameters" of={action.inputs} />
      <Values title="Outputs" of={action.outputs} />
      {action.type === "graph" && (
        <p className="m-0 ink3 text-12">
          It stands for another graph, which this link does not show.
        </p>
      )}
    </div>
  );
}

function Values({ title, of }: { title: string; of: Action["inputs"] }) {
  if (of.length === 0) return null;
  return (
    <section aria-label={title}>
      <h3 className="m-0 ink3 text-12 weight-500">{title}</h3>
      <dl className={style.values}>
        {of.map(({ path, text }) => (
          <div key={path}>
            <dt>{path}</dt>
            <dd>{text}</dd>
          </div>
        ))}
      </dl>
    </section>
  );
}

/** A run for the parts of the page that show runs: without anything that a link does not tell. */
function runOf({ run }: SharedRun): Run {
  const { held_since, unconfirmed, seen_to_rest: _, ...state } = run;
  return {
    ...state,
    ...NOT_TOLD,
    unconfirmed: unconfirmed ? "It is not proven that it has stopped." : null,
    held: held_since === null ? null : { by: null, why: "", since: held_since },
  };
}

const NOT_TOLD = {
  id: "",
  number: 0,
  graph: null,
  version: null,
  digest: "",
  author: { id: "", name: "" },
  at_rest: null,
  group: null,
  stopped_by: null,
  detail: "",
  alarms: [],
  like: null,
  behaviours: false,
  log: [],
} satisfies Partial<Run>;

function wordOf(run: Run, { seen_to_rest }: SharedRun["run"], lost: number | null) {
  const told = runStatus(run, { link: lost === null ? "live" : "down", since: lost ?? 0 });
  if (run.ended_at === null) return told;
  return seen_to_rest
    ? { ...told, word: `${runLabel(run).word}: seen at rest, not proven by its engine` }
    : { ...told, word: runEndText(run) };
}

function RunSeen({ thing, lost }: { thing: SharedRun; lost: number | null }) {
  const run = useMemo(() => runOf(thing), [thing]);
  const written = JSON.stringify(thing.umrf);
  const graph = useMemo(() => fromUmrf(JSON.parse(written)), [written]);
  const goes = run.ended_at === null;
  const seen = useProgress(run, goes && lost !== null);
  const progress = useMemo(() => withWaits(graph, seen), [graph, seen]);
  const lanes = useMemo(() => lanesOf(run, graph), [run, graph]);
  return (
    <Frame
      title={run.graph_name || "Run"}
      status={
        <>
          <StateLabel pill {...wordOf(run, thing.run, lost)} />
          <span className="ink3 text-12 nowrap">{runPlace(run)}</span>
          {goes && lost === null && <EngineSeen seen={thing.seen} />}
        </>
      }
      lost={goes ? lost : null}
      note="Stop is on the page of this server, for everybody who is signed in there, and on the robot."
    >
      <section className={style.canvas} aria-label="Graph of the run">
        <Canvas graph={graph} progress={progress} label={isolated(run.graph_name)} />
      </section>
      <section className={style.strip} aria-label="Timeline">
        <Timeline
          run={run}
          lanes={lanes}
          silentSince={goes && lost !== null ? serverTimeOf(lost) : instant(run.unknown_since)}
        />
      </section>
    </Frame>
  );
}

/** Says for how long the engine has not shown the run, once that is long. */
function EngineSeen({ seen }: { seen: string | null }) {
  const now = useNow();
  const at = instant(seen);
  if (at === null || now - at < QUIET) return null;
  return (
    <span className="ink-error text-12 nowrap">
      not shown by its engine for {duration(now - at)}
    </span>
  );
}
