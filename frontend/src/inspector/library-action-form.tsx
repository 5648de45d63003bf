/** The form of an action of the library: what it has in every graph, and nothing of one use. */
import type { ReactNode } from "react";
import { useEditorContext } from "../edit-actions/editor-context";
import { renameDocument } from "../graph/edit";
import type { Action } from "../graph/model";
import { DescriptionField, NameField, TypeField } from "./fields/action-fields";
import { type CheckedGroup, ProblemsContext } from "./fields/field-problems";
import { InLibraryContext, ViewOnly } from "./fields/view-only";
import style from "./inspector.module.css";
import { LabelsField } from "./labels";
import { ParameterList } from "./parameters/parameter-list";

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
