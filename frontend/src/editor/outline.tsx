/** The graph as a list: the twin of the canvas for small screens and screen readers. */
import { Button } from "@mantine/core";
import { IconListTree, IconPlus } from "@tabler/icons-react";
import type { Progress } from "../api/progress";
import { relationId } from "../graph/layout";
import { type Action, ENTRY, type Graph, type Key } from "../graph/model";
import { answersOf } from "../ui/canvas/elements";
import { cardLines, lineText } from "../ui/canvas/value-text";
import { Empty } from "../ui/empty";
import { OutcomeSign, outcomeColor, outcomeWord } from "../ui/outcome";
import { robotColor } from "../ui/robot";
import { StateWord } from "../ui/state-word";
import { duration } from "../ui/when";
import { endName, useBench } from "./bench";
import style from "./outline.module.css";

/** The actions in the order in which a run would come to them; unreachable ones last. */
export function inOrder(graph: Graph): Action[] {
  const actions = new Map(graph.actions.map((action) => [action.key, action]));
  const found = new Set<Key>();
  let front: Key[] = [ENTRY];
  while (front.length > 0) {
    const next: Key[] = [];
    for (const parent of front) {
      const children = graph.relations
        .filter((relation) => relation.parent === parent)
        .sort((a, b) => a.parentOrder - b.parentOrder);
      for (const { child } of children) {
        if (!actions.has(child) || found.has(child)) continue;
        found.add(child);
        next.push(child);
      }
    }
    front = next;
  }
  const rest = graph.actions.filter((action) => !found.has(action.key));
  return [...[...found].flatMap((key) => actions.get(key) ?? []), ...rest];
}

function Item({ action, progress }: { action: Action; progress: Progress | null }) {
  const { graph, selection, select, setPanel } = useBench();
  const out = graph.relations.filter((relation) => relation.parent === action.key);
  const [line] = cardLines(action.inputs, 1);
  return (
    <li
      className={style.item}
      style={{ "--c": robotColor(action.actor) } as React.CSSProperties}
      data-selected={selection.has(action.key) || undefined}
    >
      <button
        type="button"
        className={style.open}
        onClick={() => {
          select([action.key]);
          setPanel("details");
        }}
      >
        <span className={style.head}>
          <b>
            {action.name} {action.instanceId}
          </b>
          {progress && (
            <StateWord
              tone={progress.tone}
              word={progress.word}
              {...(progress.took === null ? {} : { more: duration(progress.took) })}
            />
          )}
        </span>
        <span className={style.sub}>
          {action.actor || "any robot"}
          {line && ` · ${lineText(line)}`}
        </span>
      </button>
      <div className={style.arrows}>
        {out.map((relation) => (
          <button
            type="button"
            key={relationId(relation)}
            className={style.arrow}
            onClick={() => {
              select([relationId(relation)]);
              setPanel("details");
            }}
          >
            {answersOf(relation).flatMap(({ outcomes }) =>
              outcomes.map((outcome) => (
                <span key={outcome} style={{ color: outcomeColor[outcome] }}>
                  <OutcomeSign outcome={outcome} />
                  <span className="visually-hidden">{outcomeWord[outcome]}</span>
                </span>
              )),
            )}
            → {endName(graph, relation.child)}
          </button>
        ))}
      </div>
    </li>
  );
}

export function Outline({ progress }: { progress: ReadonlyMap<Key, Progress> }) {
  const bench = useBench();
  const actions = inOrder(bench.graph);
  const add = () => {
    const middle: [number, number] = [window.innerWidth / 2, 120];
    bench.openAdd({ screen: middle, at: [0, 140 * bench.graph.actions.length], from: null });
  };
  return (
    <div className={style.outline}>
      {actions.length === 0 && (
        <Empty icon={<IconListTree size={22} />} title="Nothing here yet">
          The actions of the graph stand here as a list, in the order in which they run.
        </Empty>
      )}
      <ul className={style.list}>
        {actions.map((action) => (
          <Item key={action.key} action={action} progress={progress.get(action.key) ?? null} />
        ))}
      </ul>
      <Button className={style.add ?? ""} leftSection={<IconPlus size={16} />} onClick={add}>
        Add an action
      </Button>
    </div>
  );
}
