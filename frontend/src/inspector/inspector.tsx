/** The panel on the right: properties of what is selected, JSON, problems. */
import { Tabs } from "@mantine/core";
import { IconAlertTriangle, IconMessageCircle, IconShieldCheck } from "@tabler/icons-react";
import type { Problems } from "../api/graphs";
import {
  type EditorContext,
  type Panel,
  selectedActions,
  selectedRelations,
  useEditorContext,
} from "../edit-actions/editor-context";
import { relationId } from "../graph/document-keys";
import type { Thread } from "../graph/edit/comments";
import { notesOf } from "../graph/edit/notes";
import { EXIT } from "../graph/model";
import { countsOf } from "../graph/problems/problem-kinds";
import { endName } from "../graph/relation-words";
import { boundedPart, lazyPart, PartBoundary } from "../ui/lazy-part";
import { counted } from "../words/counted";
import { type CheckedGroup, ProblemsContext } from "./fields/field-problems";
import { SharedField } from "./fields/shared-field";
import { ViewOnly } from "./fields/view-only";
import style from "./inspector.module.css";

const forms = () => import("./forms");
const ActionForm = lazyPart(() => forms().then((part) => part.ActionForm));
const GraphForm = lazyPart(() => import("./graph-form").then((part) => part.GraphForm));
const NoteForm = lazyPart(() => forms().then((part) => part.NoteForm));
const RelationForm = lazyPart(() => forms().then((part) => part.RelationForm));
const SeveralForm = lazyPart(() => forms().then((part) => part.SeveralForm));
const RunConditions = lazyPart(() => forms().then((part) => part.RunConditions));
const ProblemList = boundedPart(() => import("./problem-list").then((part) => part.ProblemList));
const ProblemsHere = boundedPart(() => import("./problem-list").then((part) => part.ProblemsHere), {
  waiting: null,
});
const Comments = boundedPart(() => import("../comments/comments").then((part) => part.Comments));
const CoursesPanel = boundedPart(() =>
  import("../courses/courses-panel").then((part) => part.CoursesPanel),
);
const JsonView = boundedPart(() => import("./json/json-view").then((part) => part.JsonView));

interface Props {
  id: string;
  seq: number;
  panel: Panel;
  problems: Problems | undefined;
  /** The problems as they are shown to people. */
  told: readonly CheckedGroup[];
  threads: readonly Thread[];
}

const chosenNotes = ({ graph, selection }: EditorContext) =>
  notesOf(graph).filter(({ key }) => selection.has(key));

function title(context: EditorContext): string {
  const actions = selectedActions(context);
  const relations = selectedRelations(context);
  const notes = chosenNotes(context);
  const [action] = actions;
  const [note] = notes;
  const count = actions.length + relations.length + notes.length;
  if (count > 1) return `${count} selected`;
  if (note) return note.kind === "frame" ? "Frame" : "Note";
  if (action) return endName(context.graph, action.key);
  if (relations.length === 1) return "Arrow";
  return context.selection.has(EXIT) ? "Exit" : "Graph";
}

function Properties() {
  const context = useEditorContext();
  const actions = selectedActions(context);
  const relations = selectedRelations(context);
  const notes = chosenNotes(context);
  const [action] = actions;
  const [relation] = relations;
  const [note] = notes;
  if (actions.length + relations.length + notes.length > 1) {
    const counts: [number, string][] = [
      [actions.length, "action"],
      [relations.length, "arrow"],
      [notes.length, "note"],
    ];
    const parts = counts.flatMap(([count, noun]) => (count === 0 ? [] : counted(count, noun)));
    return (
      <>
        <p className="m-0 ink2">
          Selected: {parts.join(", ")}. Drag moves them together, <b>Del</b> deletes them,{" "}
          <b>Ctrl D</b> duplicates them.
        </p>
        <SeveralForm actions={actions} />
      </>
    );
  }
  if (note) return <NoteForm key={note.key} note={note} />;
  if (action) return <ActionForm key={action.key} action={action} />;
  if (relation) return <RelationForm key={relationId(relation)} relation={relation} />;
  if (context.selection.has(EXIT)) return <RunConditions of={EXIT} title="The graph ends" />;
  return <GraphForm />;
}

/** The two numbers of the top bar; warnings where there is nothing else. */
function ProblemsTab({ told }: { told: readonly CheckedGroup[] }) {
  const { wrong, fillIn, warnings } = countsOf(told);
  return (
    <span className={`inline-row gap-30 ${style.problems}`}>
      <IconAlertTriangle size={15} aria-hidden className={style.sign} />
      <span className={style.word}>Problems</span>
      {wrong > 0 && (
        <span className={style.count} data-kind="wrong">
          {wrong}
          <span className="visually-hidden"> wrong</span>
        </span>
      )}
      {fillIn > 0 && (
        <span className={style.count} data-kind="fill-in">
          {fillIn}
          <span className="visually-hidden"> to fill in</span>
        </span>
      )}
      {warnings > 0 && (
        <span className={style.count} data-kind="warning">
          {warnings}
          <span className="visually-hidden"> {warnings === 1 ? "warning" : "warnings"}</span>
        </span>
      )}
    </span>
  );
}

export function Inspector({ id, seq, panel, problems, told, threads }: Props) {
  const context = useEditorContext();
  const open = threads.filter((thread) => !thread.resolved).length;
  return (
    <Tabs
      value={panel}
      onChange={(next) => context.setPanel((next ?? "details") as Panel)}
      className={style.tabs ?? ""}
      keepMounted={false}
    >
      <Tabs.List>
        <Tabs.Tab value="details" className={style.first ?? ""}>
          {title(context)}
        </Tabs.Tab>
        <Tabs.Tab value="json">JSON</Tabs.Tab>
        <Tabs.Tab value="comments" aria-label={open === 0 ? "Comments" : `Comments, ${open} open`}>
          <span className="inline-row gap-30">
            <IconMessageCircle size={15} aria-hidden />
            {open > 0 && <span className={style.count}>{open}</span>}
          </span>
        </Tabs.Tab>
        <Tabs.Tab value="courses" aria-label="Expected courses">
          <span className="inline-row gap-30">
            <IconShieldCheck size={15} aria-hidden />
          </span>
        </Tabs.Tab>
        <Tabs.Tab value="problems">
          <ProblemsTab told={told} />
        </Tabs.Tab>
      </Tabs.List>
      <Tabs.Panel value="details" className={style.panel ?? ""}>
        <ViewOnly>
          {context.selection.size === 1 && <ProblemsHere told={told} />}
          <ProblemsContext value={told}>
            <PartBoundary>
              <Properties />
            </PartBoundary>
          </ProblemsContext>
        </ViewOnly>
      </Tabs.Panel>
      <Tabs.Panel value="json" className={style.panel ?? ""} data-fill>
        <SharedField of="graph" field="json">
          <JsonView graph={id} seq={seq} />
        </SharedField>
      </Tabs.Panel>
      <Tabs.Panel value="comments" className={style.panel ?? ""}>
        <Comments threads={threads} />
      </Tabs.Panel>
      <Tabs.Panel value="courses" className={style.panel ?? ""}>
        <CoursesPanel seq={seq} />
      </Tabs.Panel>
      <Tabs.Panel value="problems" className={style.panel ?? ""}>
        <ProblemList problems={problems} told={told} seq={seq} />
      </Tabs.Panel>
    </Tabs>
  );
}
