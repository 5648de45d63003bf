/** Turns off the fields of a form where the person may only look, or the action belongs to the library. */

import { MantineThemeProvider } from "@mantine/core";
import { createContext, type ReactNode, use } from "react";
import { useEditorContext } from "../../edit-actions/editor-context";
import style from "../inspector.module.css";

export const InLibraryContext = createContext(false);

export const useInLibrary = (): boolean => use(InLibraryContext);

const OFF = { defaultProps: { disabled: true } };
/** Its text can be marked and copied. */
const READ = { defaultProps: { readOnly: true } };

/** Buttons that only show or copy something say `disabled={false}` for themselves. */
const LOOKING = {
  components: {
    Button: OFF,
    ActionIcon: OFF,
    Switch: OFF,
    SegmentedControl: OFF,
    TextInput: READ,
    Textarea: READ,
    Select: READ,
    Autocomplete: READ,
    TagsInput: READ,
  },
};

export function ViewOnly({ children }: { children: ReactNode }) {
  const { mayEdit } = useEditorContext();
  return (
    <MantineThemeProvider theme={mayEdit ? {} : LOOKING}>
      <div className={style.fields} data-looking={!mayEdit || undefined}>
        {children}
      </div>
    </MantineThemeProvider>
  );
}
