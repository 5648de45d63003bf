/** The properties of an action. */
import { Button, Group } from "@mantine/core";
import { IconGhost2, IconPackage } from "@tabler/icons-react";
import { useEditorContext } from "../edit-actions/editor-context";
import { adoptGhost, rename, setField } from "../graph/edit";
import type { Action } from "../graph/model";
import { DraftInput } from "../ui/draft-input";
import { ArrowList } from "./arrow-list";
import { DescriptionField, NameField, TypeField } from "./fields/action-fields";
import { SharedField } from "./fields/shared-field";
import style from "./inspector.module.css";
import { ParameterList } from "./parameters/parameter-list";
import { RobotField } from "./robot-field";
import { RunConditions } from "./run-conditions";

function wholeNumber(draft: string): string | null {
  return /^\d{1,5}$/.test(draft) && Number(draft) < 65536
    ? null
    : "A whole number from 0 to 65535.";
}

/** An action that arrows name and that is not there. */
function Ghost({ action }: { action: Action }) {
  const { doc } = useEditorContext();
  return (
    <div className={style.say} data-tone="error" data-form={action.key}>
      <IconGhost2 size={16} aria-hidden />
      <div>
        Arrows name{" "}
        <b>
          {action.name} {action.instanceId}
        </b>
        , but the graph has no such action. The graph cannot be started like this.
        <Group mt="sm">
          <Button size="compact-sm" onClick={() => adoptGhost(doc, action.key)}>
            Make it an action
          </Button>
        </Group>
      </div>
    </div>
  );
}

export function ActionForm({ action }: { action: Action }) {
  const { doc, openOverlay } = useEditorContext();
  if (action.missing) return <Ghost action={action} />;
  return (
    <div className={style.form} data-form={action.key}>
      <div className={style.nameRow}>
        <NameField action={action} onRename={(name) => rename(doc, action.key, name)} />
        <SharedField of={action.key} field="number">
          <DraftInput
            label="Number"
            value={String(action.instanceId)}
            inputMode="decimal"
            check={wholeNumber}
            onCommit={(text) => setField(doc, action.key, "instanceId", Number(text))}
          />
        </SharedField>
      </div>
      <SharedField of={action.key} field="robot">
        <RobotField actions={[action]} />
      </SharedField>
      <DescriptionField action={action} />
      <ParameterList action={action} side="in" />
      <RunConditions of={action.key} title="When" />
      <ArrowList action={action} />
      <ParameterList action={action} side="out" />
      <section className={style.section}>
        <TypeField action={action} />
        <Button
          variant="default"
          mt="sm"
          leftSection={<IconPackage size={16} aria-hidden />}
          onClick={() => openOverlay({ kind: "packages", action: action.name })}
        >
          C++ package
        </Button>
      </section>
    </div>
  );
}
