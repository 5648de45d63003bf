/** The graph as UMRF JSON: in step with what is selected, and a way to edit it. */
import { ActionIcon, Button, CopyButton, Kbd, Skeleton } from "@mantine/core";
import { IconAlertTriangle, IconCheck, IconCopy } from "@tabler/icons-react";
import { type ReactNode, useMemo, useState } from "react";
import type { KeyChange } from "../../api/graphs";
import { errorText } from "../../api/http";
import { printedKeys } from "../../edit-actions/edit-action";
import {
  selectedActions,
  selectedRelations,
  useEditorContext,
} from "../../edit-actions/editor-context";
import { applyChanges, collisions, places } from "../../graph/edit/key-changes";
import { lazyPart, PartBoundary } from "../../ui/lazy-part";
import { Tooltip } from "../../ui/tooltip";
import { counted } from "../../words/counted";
import { isolated } from "../../words/isolated";
import type { JsonError } from "./json-editor";
import { actionAt, rangeOf, rangeOfArrow } from "./json-positions";
import style from "./json-view.module.css";
import { useJson, type Verdict } from "./use-json";

const JsonEditor = lazyPart(() => import("./json-editor").then((part) => part.default), {
  heavy: true,
});
const NO_FAULTS: readonly JsonError[] = [];

function faultsOf(verdict: Verdict): readonly JsonError[] {
  return verdict.kind === "wrong" ? [verdict.fault] : NO_FAULTS;
}

function VerdictWords({ verdict, onShow }: { verdict: Verdict; onShow: readonly string[] }) {
  switch (verdict.kind) {
    case "checking":
      return <p className="ink3">Checking …</p>;
    case "unknown":
      return (
        <p data-tone="warning">
          Your text cannot be checked now: {verdict.why} It is kept in this page.
        </p>
      );
    case "wrong":
      return (
        <p data-tone="error">
          <IconAlertTriangle size={14} aria-hidden /> Line {verdict.fault.line + 1}:{" "}
          {verdict.fault.message} Nothing is changed until this is right.
        </p>
      );
    case "fits": {
      const { changes, problems } = verdict.rewriting;
      if (changes.length === 0)
        return <p className="ink3">The text means the same as before: nothing changes.</p>;
      const some = onShow.slice(0, 3).join(", ");
      const more = onShow.length > 3 ? ` and ${onShow.length - 3} more` : "";
      return (
        <>
          <p>
            Changes {some}
            {more}.
          </p>
          {problems.map((problem) => (
            <p key={`${problem.code} ${problem.message}`} data-tone="warning">
              <b>{problem.code}</b> {problem.message}
            </p>
          ))}
        </>
      );
    }
  }
}

interface MeanwhileProps {
  names: readonly string[];
  onRest: (() => void) | null;
  onAll: () => void;
  onBack: () => void;
}

/** Says that another person has changed the same values meanwhile, and asks before they are overwritten. */
function Meanwhile({ names, onRest, onAll, onBack }: MeanwhileProps) {
  return (
    <div className={style.foot} role="alertdialog" aria-label="Changed meanwhile">
      <p data-tone="warning">
        <IconAlertTriangle size={14} aria-hidden /> Somebody changed{" "}
        {names.map(isolated).join(", ")} since you began. What should stay?
      </p>
      <div className="wrap gap-37_5">
        <Button size="compact-sm" onClick={onAll}>
          Mine
        </Button>
        <Button size="compact-sm" disabled={onRest === null} onClick={onRest ?? undefined}>
          Theirs, and the rest of mine
        </Button>
        <Button size="compact-sm" variant="subtle" onClick={onBack}>
          Look again
        </Button>
      </div>
    </div>
  );
}

export function JsonView({ graph, seq }: { graph: string; seq: number }) {
  const context = useEditorContext();
  const json = useJson(graph, seq);
  const { text, draft, verdict } = json;
  const [asking, setAsking] = useState<readonly KeyChange[] | null>(null);
  const lines = useMemo(() => (text ?? "").split("\n"), [text]);
  const [selected] = selectedActions(context);
  const name = selected?.name;
  const instanceId = selected?.instanceId;
  const [arrow] = selectedRelations(context);
  const marked = useMemo(() => {
    if (name !== undefined && instanceId !== undefined) return rangeOf(lines, { name, instanceId });
    return arrow && text !== undefined ? rangeOfArrow(context.graph, text, arrow) : null;
  }, [lines, text, name, instanceId, arrow, context.graph]);
  const faults = useMemo(() => (draft ? faultsOf(verdict) : NO_FAULTS), [draft, verdict]);
  const changes = verdict.kind === "fits" && draft ? verdict.rewriting.changes : [];
  const write = (some: readonly KeyChange[]) => {
    applyChanges(context.doc, some);
    setAsking(null);
    json.done();
  };
  const apply = () => {
    if (changes.length === 0) return;
    const taken = collisions(context.doc, changes);
    if (taken.length === 0) write(changes);
    else setAsking(taken);
  };
  const follow = (line: number) => {
    const action = actionAt(context.graph, lines, line);
    if (action && !context.selection.has(action.key)) context.select([action.key]);
  };
  if (json.error && text === undefined) return <p>{errorText(json.error)}</p>;
  if (text === undefined) return <Skeleton height={200} />;
  let foot: ReactNode = null;
  if (asking !== null) {
    const rest = changes.filter((change) => !asking.includes(change));
    foot = (
      <Meanwhile
        names={places(context.graph, asking)}
        onRest={rest.length > 0 ? () => write(rest) : null}
        onAll={() => write(changes)}
        onBack={() => setAsking(null)}
      />
    );
  } else if (draft) {
    foot = (
      <section className={style.foot} aria-label="Your edit of the JSON">
        <div className={style.words} role="status">
          <VerdictWords verdict={verdict} onShow={places(context.graph, changes)} />
        </div>
        <div className="wrap gap-37_5">
          <Button
            size="compact-sm"
            variant="filled"
            disabled={changes.length === 0}
            onClick={apply}
            rightSection={<Kbd>{printedKeys("Mod+Enter").join(" ")}</Kbd>}
          >
            {changes.length === 0 ? "Apply" : `Apply ${counted(changes.length, "change")}`}
          </Button>
          <Button size="compact-sm" variant="subtle" onClick={json.discard}>
            Discard
          </Button>
        </div>
      </section>
    );
  }
  return (
    <div className="column relative gap-50">
      <div className={style.copy}>
        <CopyButton value={text}>
          {({ copied, copy }) => (
            <Tooltip label={copied ? "Copied" : "Copy all"}>
              <ActionIcon onClick={copy} aria-label="Copy the JSON">
                {copied ? <IconCheck size={15} /> : <IconCopy size={15} />}
              </ActionIcon>
            </Tooltip>
          )}
        </CopyButton>
      </div>
      <PartBoundary>
        <JsonEditor
          text={text}
          readOnly={!context.mayEdit}
          faults={faults}
          marked={marked}
          onChange={json.edit}
          onLine={follow}
          onApply={apply}
        />
      </PartBoundary>
      {foot}
    </div>
  );
}
