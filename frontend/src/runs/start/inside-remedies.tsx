/** What to do where a robot has not indexed the graphs inside, or would not look them up: its files, or one graph. */
import { IconDownload } from "@tabler/icons-react";
import { Link } from "wouter";
import { serverPath } from "../../api/page-url";
import type { Preflight, PreflightItem } from "../../api/robots";
import style from "./preflight-list.module.css";

/** The moment that is looked at. */
export interface MomentLookedAt {
  readonly graph: string;
  readonly seq: number;
  /** What leads away from the look closes it. */
  readonly onLeave: () => void;
  /** Look again, now. */
  readonly onLookAgain: () => void;
}

interface Props extends MomentLookedAt {
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

/** Nothing where nothing of this item comes from graphs inside. */
export function InsideRemedies({ item, look, graph, seq, onLeave }: Props) {
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
  if (item.code !== "again" || !look.items.some(({ code }) => code === "subgraphs")) return null;
  return (
    <span className={style.remedies}>
      <span>
        One graph that does the same has no graphs inside that would have to be looked up, and a
        name of its own.
      </span>
      <OneGraph graph={graph} onLeave={onLeave} />
    </span>
  );
}
