/** Frame of every screen: the bar on top, with room for STOP, and the screen below. */
import { Button } from "@mantine/core";
import { IconBolt, IconHistory, IconMapOff, IconRobot, IconShare } from "@tabler/icons-react";
import { memo, type ReactNode, useEffect, useLayoutEffect, useMemo, useState } from "react";
import { Link } from "wouter";
import { AccountMenu } from "../account/account-menu";
import { foreignGraphs, type LiveState, openRuns } from "../api/live-socket";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import type { ViewedThing } from "../api/view-links";
import { graphOnScreen } from "../runs/stop/stop-surroundings";
import { Empty } from "../ui/empty";
import { useIsPhone, useStableCallback } from "../ui/hooks";
import { boundedPart, lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { NAME_RANK, useNameColors } from "../ui/name-colors";
import { type Crumb, TopBar } from "../ui/top-bar";
import { isolated } from "../words/isolated";
import style from "./page-frame.module.css";

const leave = async (person: string) => {
  const { leaveDevice } = await import("../sync/kept-graphs");
  await leaveDevice(person);
};

interface Props {
  crumbs: readonly Crumb[];
  status?: ReactNode;
  actions?: ReactNode;
  start?: ReactNode;
  /** The graph on screen. */
  graph?: string;
  /** The run on screen. */
  run?: string;
  /** The screen is one of those that the bar leads to. */
  at?: "runs" | "robots" | "actions";
}

interface WayProps {
  to: string;
  icon: typeof IconHistory;
  name: string;
  /** Set if another element needs the room on a narrow screen. */
  tight: boolean;
  /** Beside a graph, whose name and state need the room of a phone. */
  beside: boolean;
}

// The bar is drawn with the graph; what of it is always the same is not.
const Account = memo(AccountMenu);
const Sharing = memo(
  lazyPart(() => import("../account/share-dialog").then((part) => part.ShareDialog)),
);
const MovesNow = boundedPart(() => import("../runs/moves-now").then((part) => part.MovesNowLine), {
  waiting: null,
});

const robotNamesIn = ({ engines }: LiveState): string[] =>
  engines.flatMap(({ name, simulated }) => (simulated ? [] : [name]));

/** Its code is loaded when something may move. */
const Moving = memo(function Moving() {
  const { now } = useLive();
  useNameColors(NAME_RANK.robots, robotNamesIn(now));
  return openRuns(now).length + foreignGraphs(now).length > 0 ? <MovesNow /> : null;
});
const Asked = boundedPart(() => import("../status/asked-line").then((part) => part.AskedLine), {
  waiting: null,
});

/** Its code is loaded when a run asks somebody. */
const Asking = memo(function Asking({ below }: { below: boolean }) {
  const { now } = useLive();
  const some = openRuns(now).some(({ questions }) => questions?.length);
  return some ? <Asked below={below} /> : null;
});

const Way = memo(function Way({ to, icon: Icon, name, tight, beside }: WayProps) {
  return (
    <Button
      component={Link}
      to={to}
      variant="subtle"
      color="gray"
      px="sm"
      aria-label={name}
      leftSection={<Icon size={16} aria-hidden />}
      className={style.way ?? ""}
      data-tight={tight || undefined}
      data-graph={beside || undefined}
    >
      {name}
    </Button>
  );
});

function thingOf(graph: string | undefined, run: string | undefined): ViewedThing | null {
  if (graph !== undefined) return { kind: "graph", id: graph };
  return run === undefined ? null : { kind: "run", id: run };
}

export function PageBar({ crumbs, status, actions, start, graph, run, at }: Props) {
  const mayShare = useMay("share");
  const thing = useMemo(() => thingOf(graph, run), [graph, run]);
  useLayoutEffect(() => {
    graphOnScreen.set(graph ?? null);
    return () => graphOnScreen.set(null);
  }, [graph]);
  // Null until it was asked for: from then on it stays, and gives the focus back when it closes.
  const [sharing, setSharing] = useState<boolean | null>(null);
  const share = useStableCallback(() => setSharing(true));
  const closeSharing = useStableCallback(() => setSharing(false));
  const ways = { tight: Boolean(start) || run !== undefined, beside: graph !== undefined };
  const { tight } = ways;
  const isPhone = useIsPhone();
  return (
    <div className={style.top}>
      <TopBar
        crumbs={crumbs}
        status={
          <>
            {status}
            <Moving />
            {!isPhone && <Asking below={false} />}
          </>
        }
        actions={
          <>
            {actions}
            {at !== "actions" && <Way to="/actions" icon={IconBolt} name="Actions" {...ways} />}
            {at !== "robots" && <Way to="/robots" icon={IconRobot} name="Robots" {...ways} />}
            {at !== "runs" && <Way to="/runs" icon={IconHistory} name="Runs" {...ways} />}
            {mayShare && (
              <Button
                variant="subtle"
                color="gray"
                px="sm"
                aria-label="Share"
                leftSection={<IconShare size={16} aria-hidden />}
                className={`${style.way ?? ""} ${style.share ?? ""}`}
                data-tight={tight || undefined}
                onClick={share}
              >
                Share
              </Button>
            )}
            {mayShare && (
              <OverlayBoundary>
                {sharing !== null && (
                  <Sharing opened={sharing} onClose={closeSharing} thing={thing} />
                )}
              </OverlayBoundary>
            )}
          </>
        }
        account={<Account onShare={mayShare ? share : null} onLeave={leave} />}
        start={start}
      />
      {isPhone && <Asking below />}
    </div>
  );
}

/** Bar above, screen below, each scrolling by itself. */
export function PageFrame({ children }: { children: ReactNode }) {
  return <div className={style.frame}>{children}</div>;
}

interface NowhereProps {
  /** Name of this place in the bar. */
  crumb: string;
  title: string;
  children?: ReactNode;
}

/** Shows a notice in place of a page, with a link to all graphs. */
export function Nowhere({ crumb, title, children }: NowhereProps) {
  return (
    <>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: crumb }]} />
      <main>
        <Empty
          icon={<IconMapOff size={22} />}
          title={title}
          action={
            <Button component={Link} to="/">
              All graphs
            </Button>
          }
        >
          {children}
        </Empty>
      </main>
    </>
  );
}

export function NotFound() {
  return (
    <PageFrame>
      <Nowhere crumb="Nowhere" title="There is nothing at this address" />
    </PageFrame>
  );
}

export function useTitle(title: string): void {
  useEffect(() => {
    document.title = `${isolated(title)} · TeMoto Action Assistant`;
  }, [title]);
}
