/** The mark by which a start asks for an input, and the bounds of what can be given there. */
import { Group, Switch } from "@mantine/core";
import { useEditorContext } from "../../edit-actions/editor-context";
import { setAsk } from "../../graph/edit/asks";
import type { Action, Parameter } from "../../graph/model";
import { askedPaths, askOf, type Bounds } from "../../graph/parameters/asked-inputs";
import { readValue } from "../../graph/parameters/data-flow";
import { typed } from "../../graph/parameters/values";
import { DraftInput } from "../../ui/draft-input";
import { useInLibrary } from "../fields/view-only";

interface Props {
  action: Action;
  parameter: Parameter;
}

export function AskSetting({ action, parameter }: Props) {
  const { doc, graph } = useEditorContext();
  const { native, value, required } = readValue(parameter);
  if (useInLibrary() || native === null) return null;
  const { path } = parameter;
  const bounds = askOf(action, path);
  const isAsked = askedPaths(graph).get(action.key)?.has(path) ?? false;
  const set = (next: Bounds | null) => setAsk(doc, action.key, path, next);
  const description =
    bounds !== null && !isAsked
      ? "Arrows bring the value each time, so no start asks for it"
      : value !== null
        ? "Whoever starts the graph can give another value than this one"
        : required
          ? "A start asks for it as long as the graph has no value"
          : "Whoever starts the graph can give a value";
  return (
    <>
      <Switch
        label="Ask at the start"
        description={description}
        checked={bounds !== null}
        onChange={(event) => set(event.currentTarget.checked ? {} : null)}
      />
      {bounds !== null && (native === "number" || native === "numbers") && (
        <Group gap="xs" wrap="nowrap" align="start">
          <Bound label="At least" of="least" bounds={bounds} onSet={set} />
          <Bound label="At most" of="most" bounds={bounds} onSet={set} />
        </Group>
      )}
    </>
  );
}

interface BoundProps {
  label: string;
  of: keyof Bounds;
  bounds: Bounds;
  onSet: (bounds: Bounds) => boolean;
}

function Bound({ label, of, bounds, onSet }: BoundProps) {
  const { [of]: own, ...other } = bounds;
  const check = (draft: string): string | null => {
    const found = typed("number", draft);
    if ("wrong" in found) return found.wrong;
    if (found.ok === null) return null;
    const least = of === "least" ? Number(found.ok) : (bounds.least ?? -Infinity);
    const most = of === "most" ? Number(found.ok) : (bounds.most ?? Infinity);
    return least > most ? "The least is more than the most." : null;
  };
  return (
    <DraftInput
      label={label}
      inputMode="decimal"
      mono
      value={own === undefined ? "" : String(own)}
      placeholder="any"
      check={check}
      onCommit={(draft) => {
        const found = typed("number", draft);
        if (!("ok" in found)) return false;
        return onSet(found.ok === null ? other : { ...other, [of]: Number(found.ok) });
      }}
    />
  );
}
