/** Forms of an action: of one in a graph, and of one of the library. */
import { Button, Group } from "@mantine/core";
import { IconGhost2, IconPackage, IconRotateClockwise } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import { adoptGhost, rename, renameDocument, setField } from "../graph/edit";
import type { Action } from "../graph/model";
import { isReadyMade, shownName } from "../graph/questions";
import { DraftInput } from "../ui/draft-input";
import { isolated } from "../words/isolated";
import { ArrowList } from "./arrow-list";
import { ActionBreakpoint } from "./breakpoint-field";
import { DescriptionField, NameField, TypeField } from "./fields/action-fields";
import { type CheckedGroup, ProblemsContext } from "./fields/field-problems";
import { SharedField } from "./fields/shared-field";
import { InLibraryContext, ViewOnly } from "./fields/view-only";
import style from "./inspector.module.css";
import { LabelsField } from "./labels";
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
          {shownName(action.name)} {action.instanceId}
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
  const { doc, openOverlay, mayEdit } = useEditorContext();
  if (action.missing) return <Ghost action={action} />;
  return (
    <div className={style.form} data-form={action.key}>
      <div className={style.nameRow}>
        <NameField
          action={action}
          description={
            isReadyMade(action) && (
              <span className="quiet-12">{isolated(shownName(action.name))}, as files call it</span>
            )
          }
          onRename={(name) => rename(doc, action.key, name)}
        />
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
      <ActionBreakpoint action={action} />
      <section className={style.section}>
        <TypeField action={action} />
        <Group gap="sm" mt="sm">
          <Button
            variant="default"
            leftSection={<IconPackage size={16} aria-hidden />}
            onClick={() => openOverlay({ kind: "packages", action: action.name })}
          >
            C++ package
          </Button>
          {mayEdit && (
            <Button
              variant="default"
              leftSection={<IconRotateClockwise size={16} aria-hidden />}
              onClick={() => openOverlay({ kind: "tries", action: action.key })}
            >
              Try again …
            </Button>
          )}
        </Group>
      </section>
    </div>
  );
}

interface Props {
  action: Action;
  /** Fields that follow from its name. */
  names: ReactNode;
  told: readonly CheckedGroup[];
}

export function LibraryActionForm({ action, names, told }: Props) {
  const { doc } = useEditorContext();
  return (
    <ViewOnly>
      <ProblemsContext value={told}>
        <div className={style.form}>
          <NameField
            action={action}
            description={names}
            onRename={(name) => renameDocument(doc, action.key, name)}
          />
          <DescriptionField action={action} />
          <LabelsField />
          <InLibraryContext value={true}>
            <ParameterList action={action} side="in" />
            <ParameterList action={action} side="out" />
          </InLibraryContext>
          <section className={style.section}>
            <TypeField action={action} />
          </section>
        </div>
      </ProblemsContext>
    </ViewOnly>
  );
}
