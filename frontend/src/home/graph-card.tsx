/** A graph as a card: how it is, and who is in it. */

import { IconDots } from "@tabler/icons-react";
import type { ComponentType } from "react";
import { Link } from "wouter";
import type { GraphSummary } from "../api/graphs";
import { useKnownColors } from "../api/people";
import type { Run } from "../api/runs";
import { shiftOfRun } from "../api/site-places";
import { useRunStatus } from "../status/progress";
import { StateLabel } from "../status/state-label";
import { LateOpening } from "../ui/late-opening";
import { lazyPart } from "../ui/lazy-part";
import { colorOfName, initials, nameColors } from "../ui/name-colors";
import { ago, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./graph-card.module.css";
import { GraphCounts } from "./graph-counts";
import { GraphPreview } from "./graph-preview";
import home from "./home.module.css";

const GraphMenu = lazyPart(() => import("./graph-menu").then((part) => part.GraphMenu));

const FEW = 4; // robots or labels on a card

function LastRun({ run, now }: { run: Run; now: number }) {
  const going = run.ended_at === null;
  const at = instant(run.ended_at ?? run.started_at ?? run.requested_at);
  return (
    <StateLabel
      {...useRunStatus(run)}
      {...(at === null || going ? {} : { more: ago(at, now - shiftOfRun(run.id)) })}
    />
  );
}

function People({ people }: { people: NonNullable<GraphSummary["people"]> }) {
  const colorOf = useKnownColors(people.map(({ id }) => id));
  if (people.length === 0) return null;
  const names = people.map(({ name }) => isolated(name || "Guest")).join(", ");
  return (
    <span className={style.people} title={`Now here: ${names}`}>
      <span className="visually-hidden">Now here: {names}</span>
      {people.slice(0, FEW).map(({ id, name }) => (
        <i key={id} style={{ background: colorOf(id) }} aria-hidden>
          {initials(name || "Guest")}
        </i>
      ))}
      {people.length > FEW && <i aria-hidden>+{people.length - FEW}</i>}
    </span>
  );
}

interface GraphCardProps {
  graph: GraphSummary;
  last: Run | null;
  /** The names on the way to its folder, where it is in another one than the one on screen. */
  place: string;
  /** The button that runs it in the simulator for the first time. */
  Try: ComponentType<{ graph: GraphSummary }>;
}

export function GraphCard({ graph, last, place, Try }: GraphCardProps) {
  const now = useNow(20_000);
  const at = instant(graph.updated_at);
  const { robots = [], labels = [], people = [] } = graph;
  return (
    <article className={home.card} style={nameColors(robots)}>
      <Link to={`/graphs/${graph.id}`} className="block ink-inherit no-underline">
        <div className={home.preview}>
          {graph.actions !== 0 && (
            <GraphPreview graph={graph.id} digest={graph.thumbnail ?? undefined} />
          )}
          <People people={people} />
        </div>
        <div className={home.body}>
          <h3 className={home.name}>{graph.name || "Untitled"}</h3>
          <p className={home.description}>{graph.description || "No description yet"}</p>
          {place !== "" && (
            <p className={`${style.marks} truncate`}>
              In <bdi>{place}</bdi>
            </p>
          )}
          {(robots.length > 0 || labels.length > 0) && (
            <p className={style.marks}>
              {robots.slice(0, FEW).map((robot) => (
                <span key={robot} className={style.robot}>
                  <i style={{ background: colorOfName(robot) }} aria-hidden />
                  <span className="visually-hidden">robot </span>
                  {robot}
                </span>
              ))}
              {robots.length > FEW && <span>+{robots.length - FEW}</span>}
              {labels.slice(0, FEW).map((label) => (
                <span key={label} className={style.label}>
                  {label}
                </span>
              ))}
              {labels.length > FEW && <span>+{labels.length - FEW}</span>}
            </p>
          )}
          <div className={home.facts}>
            {last && <LastRun run={last} now={now} />}
            <GraphCounts graph={graph} />
            <span>
              {counted(graph.actions ?? 0, "action")}
              {graph.drafts && ` · ${counted(graph.drafts, "draft")}`}
              {at !== null && ` · changed ${ago(at, now)}`}
            </span>
          </div>
        </div>
      </Link>
      {last === null && graph.actions !== 0 && graph.actions !== undefined && (
        <div className={home.try}>
          <Try graph={graph} />
        </div>
      )}
      <LateOpening opens="menu" part={(button) => <GraphMenu graph={graph} button={button} />}>
        <button
          type="button"
          className={home.more}
          aria-label={`More about ${isolated(graph.name)}`}
        >
          <IconDots size={16} aria-hidden />
        </button>
      </LateOpening>
    </article>
  );
}
