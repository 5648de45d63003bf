/** What an input gets from outputs, as chips that lead to the actions that give it. */
import { IconArrowLeft } from "@tabler/icons-react";
import { useEditorContext } from "../../edit-actions/editor-context";
import { flatName } from "../../graph/document-keys";
import type { InputGiver } from "../../graph/parameters/data-flow";
import { endName } from "../../graph/relation-words";
import style from "./data-flow.module.css";

interface Props {
  givers: readonly InputGiver[];
  /** The path of the input, or of the group. */
  path: string;
}

/** The output's name is said where it differs from that of the input. */
export function GiverChips({ givers, path }: Props) {
  const { graph, select } = useEditorContext();
  const own = flatName(path);
  const shown = [...new Map(givers.map((giver) => [giver.parent, giver])).values()];
  return (
    <span className={style.chips}>
      {shown.map(({ parent, output }) => (
        <button
          key={parent}
          type="button"
          className={style.chip}
          title="Show the action that gives it"
          onClick={() => select([parent])}
        >
          <IconArrowLeft size={11} aria-label="from" />
          {endName(graph, parent)}
          {output !== own && <span>.{output.replaceAll("::", ".")}</span>}
        </button>
      ))}
    </span>
  );
}
