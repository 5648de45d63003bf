/** The details while somebody looks at the history: who set what of what is selected, or what differs. */
import { type ReactNode, useDeferredValue, useEffect, useRef, useState } from "react";
import { useVersions, type Version } from "../api/graphs";
import { type Panel, useEditorContext } from "../edit-actions/editor-context";
import { endName } from "../graph/relation-words";
import { Segments } from "../ui/segments";
import { DifferenceList } from "./difference-list";
import type { GraphChanges } from "./graph-difference";
import style from "./past-details.module.css";
import { PastWays } from "./restoring";
import { WhoSetWhat } from "./who-set-what";

const NONE: readonly Version[] = [];

interface Props {
  changes: GraphChanges | null;
  /** The panel that was asked for last: asking for one leads there. */
  panel: Panel;
  children: ReactNode;
}

function PastPart({ changes }: { changes: GraphChanges | null }) {
  const { graph, selection } = useEditorContext();
  const [only, ...others] = selection;
  if (only !== undefined && others.length === 0) {
    const gone = changes?.things.find(({ key }) => key === only)?.name;
    const isAction = graph.actions.some(({ key }) => key === only);
    const what = isAction ? endName(graph, only) : (gone ?? "it");
    return (
      <>
        <h2>{isAction ? what : (gone ?? "Arrow or note")}</h2>
        <WhoSetWhat key={only} of={only} what={what} />
      </>
    );
  }
  if (changes !== null) return <DifferenceList changes={changes} />;
  return <WhoSetWhat of="" what="the graph" />;
}

export function PastDetails({ changes: newest, panel, children }: Props) {
  // What stands beside the canvas follows it.
  const changes = useDeferredValue(newest);
  const { id, selection } = useEditorContext();
  const { data: versions = NONE } = useVersions(id);
  const [tab, setTab] = useState<"past" | "details">("past");
  const asked = useRef(panel);
  useEffect(() => {
    if (asked.current !== panel) setTab("details");
    asked.current = panel;
  }, [panel]);
  const label = selection.size === 1 || changes === null ? "Who set what" : "What differs";
  return (
    <div className="column">
      <div className={style.tabs}>
        <Segments
          label="What the details show"
          fullWidth
          size="xs"
          data={[
            { value: "past", label },
            { value: "details", label: "Details" },
          ]}
          value={tab}
          onChange={setTab}
        />
      </div>
      {tab === "past" ? (
        <section className={style.part} aria-label={label}>
          <PastPart changes={changes} />
          <PastWays versions={versions} />
        </section>
      ) : (
        <div className="fill-y">{children}</div>
      )}
    </div>
  );
}
