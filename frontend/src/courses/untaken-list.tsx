/** The outcomes that no expected course takes: where they are, and a test that would take them. */
import { Button } from "@mantine/core";
import { IconFlask } from "@tabler/icons-react";
import { useState } from "react";
import {
  type ArrowProposal,
  type CheckedCourses,
  expectDryRun,
  type OutcomeArrow,
  proposeCourse,
} from "../api/courses";
import type { Script } from "../api/dry-runs";
import { errorText } from "../api/http";
import type { UntakenPlaces } from "../canvas/editor-store";
import { OutcomeSign, outcomeColor, outcomeWord } from "../canvas/outcome";
import { useEditorContext } from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import type { Graph, Precondition } from "../graph/model";
import { endName } from "../graph/relation-words";
import { isolated } from "../words/isolated";
import style from "./courses.module.css";
import { NameField } from "./keep-dry-run";

type ProposalSearch =
  | { kind: "searching" }
  | { kind: "found"; proposal: ArrowProposal; seq: number }
  | { kind: "failed"; why: string };

interface Props {
  runner: string;
  seq: number;
  arrows: readonly OutcomeArrow[];
  onKept: () => Promise<unknown>;
}

/** Result of the search for a course through an arrow, with buttons. */
function Verdict({ runner, found, arrow, onKept }: VerdictProps) {
  const { id, graph, mayGoBack, beginDryRun } = useEditorContext();
  const [naming, setNaming] = useState(false);
  const { proposal, seq } = found;
  if (proposal.verdict === "unreachable") {
    return (
      <p className={style.verdict} role="status">
        Nothing can take this outcome, however the actions end and in whatever order:{" "}
        {proposal.states === 0
          ? "no arrow leads there."
          : `all ${proposal.states} states were checked.`}
      </p>
    );
  }
  if (proposal.verdict !== "reached" || proposal.script === null) {
    return (
      <p className={style.verdict} role="status">
        Not decided after {proposal.states} states. {proposal.why}
      </p>
    );
  }
  const script = proposal.script as Script;
  const proposed = `${endName(graph, arrow.parent)} ends ${outcomeWord[arrow.outcome]}`;
  if (naming) {
    return (
      <NameField
        proposed={proposed.slice(0, 100)}
        onKeep={async (name) => {
          await expectDryRun(runner, { graph: id, seq, script }, name);
          await onKept();
        }}
        onClose={() => setNaming(false)}
      />
    );
  }
  return (
    <div className={style.verdict} role="status">
      A test was found.{" "}
      <Button
        size="compact-xs"
        variant="default"
        leftSection={<IconFlask size={13} aria-hidden />}
        onClick={() => beginDryRun(null, script.behaviours ?? {})}
      >
        Play it
      </Button>{" "}
      {mayGoBack && (
        <Button size="compact-xs" onClick={() => setNaming(true)}>
          Keep it …
        </Button>
      )}
    </div>
  );
}

interface VerdictProps {
  runner: string;
  found: Extract<ProposalSearch, { kind: "found" }>;
  arrow: OutcomeArrow;
  onKept: () => Promise<unknown>;
}

function UntakenRow({
  runner,
  seq,
  arrow,
  onKept,
}: Omit<Props, "arrows"> & { arrow: OutcomeArrow }) {
  const { id, graph, select, view } = useEditorContext();
  const [found, setFound] = useState<ProposalSearch | null>(null);
  const words = arrowWords(graph, arrow);
  const search = async () => {
    setFound({ kind: "searching" });
    try {
      setFound({ kind: "found", seq, proposal: await proposeCourse(runner, id, seq, arrow) });
    } catch (error) {
      setFound({ kind: "failed", why: errorText(error) });
    }
  };
  const show = () => {
    select([relationId(arrow)]);
    view.show([arrow.parent, arrow.child]);
  };
  return (
    <li className={style.untaken} data-untaken={`${relationId(arrow)}|${arrow.outcome}`}>
      <div className="row gap-50">
        <span className={style.outcome} style={{ color: outcomeColor[arrow.outcome] }}>
          <OutcomeSign outcome={arrow.outcome} size={12} />
          <span className="visually-hidden">{outcomeWord[arrow.outcome]}: </span>
        </span>
        <button type="button" className={style.jump} onClick={show} aria-label={`Show ${words}`}>
          <bdi>{words}</bdi>
        </button>
        {found === null && (
          <Button
            size="compact-xs"
            variant="subtle"
            aria-label={`Find a test that takes ${words} when ${outcomeWord[arrow.outcome]}`}
            onClick={() => void search()}
          >
            Find a test
          </Button>
        )}
      </div>
      {found?.kind === "searching" && (
        <p className={style.verdict} role="status">
          Searching …
        </p>
      )}
      {found?.kind === "failed" && (
        <p className={style.verdict} role="alert">
          {found.why}
        </p>
      )}
      {found?.kind === "found" && <Verdict {...{ runner, found, arrow, onKept }} />}
    </li>
  );
}

export function UntakenList({ arrows, ...others }: Props) {
  return (
    <ul className={style.list} aria-label="Never taken">
      {arrows.map((arrow) => (
        <UntakenRow key={`${relationId(arrow)}|${arrow.outcome}`} arrow={arrow} {...others} />
      ))}
    </ul>
  );
}

/**
 * Return the outcomes that no course takes, by relation, and the actions that none visits. Relations that are listed
 * twice have the same: a course cannot tell them apart.
 */
export function untakenPlaces(graph: Graph, { coverage }: CheckedCourses): UntakenPlaces {
  const pairs = new Map<string, Precondition[]>();
  for (const { parent, child, outcome } of coverage.untaken) {
    const pair = `${parent}>${child}`;
    const known = pairs.get(pair);
    if (known) known.push(outcome);
    else pairs.set(pair, [outcome]);
  }
  const outcomes = new Map<string, readonly Precondition[]>();
  for (const relation of graph.relations) {
    const found = pairs.get(`${relation.parent}>${relation.child}`);
    if (found) outcomes.set(relationId(relation), found);
  }
  return { outcomes, actions: new Set(coverage.unvisited) };
}

/** Return an arrow in words, as `Dock_0 → Charge_0`. */
export function arrowWords(graph: Graph, { parent, child }: OutcomeArrow): string {
  return `${isolated(endName(graph, parent))} → ${isolated(endName(graph, child))}`;
}

/** Return whether the arrow is still in the graph: the answer may be older than the last edit. */
export function isThere(graph: Graph, { parent, child }: OutcomeArrow): boolean {
  return graph.relations.some((each) => each.parent === parent && each.child === child);
}
