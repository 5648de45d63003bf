/** The properties of the graph itself, and how to begin. */
import { add, connectTo, palette, removeSelection, showShortcuts, undo } from "../edit-actions/all";
import { useEditorContext } from "../edit-actions/editor-context";
import { FirstShortcut } from "../edit-actions/keys/shortcuts";
import { useRenameGraph } from "../edit-actions/rename-graph";
import { setGraphDescription } from "../graph/edit";
import { DraftInput } from "../ui/draft-input";
import { useHasFingersOnly } from "../ui/hooks";
import { counted } from "../words/counted";
import { SharedField } from "./fields/shared-field";
import { GraphInterface } from "./graph-interface";
import style from "./inspector.module.css";
import { LabelsField } from "./labels";

export function GraphForm() {
  const context = useEditorContext();
  const { doc, graph } = context;
  const rename = useRenameGraph(context);
  const arrows = graph.relations.length;
  return (
    <div className={style.form} data-form="graph">
      <SharedField of="graph" field="name">
        <DraftInput
          label="Graph"
          value={graph.name}
          check={(draft) => (draft.trim() === "" ? "Enter a name for the graph." : null)}
          onCommit={(name) => rename(name.trim())}
          onLeaving
        />
      </SharedField>
      <SharedField of="graph" field="description">
        <DraftInput
          label="Description"
          lines
          value={graph.description}
          placeholder="What it is for"
          onCommit={(text) => setGraphDescription(doc, text)}
        />
      </SharedField>
      <LabelsField />
      <p className="m-0 ink2">
        {counted(graph.actions.length, "action")}, {counted(arrows, "arrow")}
      </p>
      <GraphInterface />
      <section className={style.section}>
        <div className={style.heading}>
          <h2>Drawing</h2>
        </div>
        <Tips />
      </section>
    </div>
  );
}

/** Hints on how to draw, for the pointing device in use. */
function Tips() {
  if (useHasFingersOnly()) {
    return (
      <ul className={style.tips}>
        <li>Tap + and type the name of an action</li>
        <li>Tap an outcome of a card, then the action that follows</li>
        <li>Hold a finger on a card to see what you can do with it</li>
        <li>Two fingers move and zoom</li>
        <li>Tap a card or an arrow to see what it says</li>
      </ul>
    );
  }
  return (
    <ul className={style.tips}>
      <li>
        <FirstShortcut editAction={add} /> or double-click: type the name of an action
      </li>
      <li>Drag from an outcome of a card to the action that follows</li>
      <li>Drop on empty canvas to add the next action there</li>
      <li>
        <FirstShortcut editAction={connectTo} /> draws an arrow by keyboard; press again to continue
        from its end
      </li>
      <li>
        <FirstShortcut editAction={removeSelection} /> deletes, <FirstShortcut editAction={undo} />{" "}
        takes back what you did
      </li>
      <li>Select a card or an arrow to see what it says</li>
      <li>
        <FirstShortcut editAction={palette} /> finds every command,{" "}
        <FirstShortcut editAction={showShortcuts} /> shows the keys
      </li>
    </ul>
  );
}
