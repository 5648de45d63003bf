/** The breakpoint of an action or arrow: on or off, and on what it depends. */
import { Checkbox, NativeSelect, Switch } from "@mantine/core";
import { useEditorContext } from "../edit-actions/editor-context";
import {
  type Breakpoint,
  ENDS,
  type End,
  endsOn,
  PLAIN,
  readBreakpoint,
  TESTS,
  type Test,
  type ValueTest,
  valueNames,
  whyNoBreakpoint,
} from "../graph/breakpoints";
import { relationId } from "../graph/document-keys";
import { setBreakpoint } from "../graph/edit/breakpoints";
import type { Action, Relation } from "../graph/model";
import { DraftInput } from "../ui/draft-input";
import style from "./breakpoint-field.module.css";
import { SharedField } from "./fields/shared-field";
import formStyle from "./inspector.module.css";

interface FieldProps {
  of: string;
  text: string | undefined;
  /** Null: it can be set. */
  why: string | null;
  /** Outcomes after which it can wait. */
  ends: readonly End[];
  /** The action whose visits and values count. */
  action: Action | undefined;
  on: "action" | "arrow";
}

const wholeVisit = (draft: string): string | null =>
  draft === "" || (/^\d{1,7}$/.test(draft) && Number(draft) <= 1_000_000)
    ? null
    : "A whole number from 1 to 1,000,000; empty for each visit.";

/** Return a typed value as the kind of value that it looks like. */
function typedValue(draft: string): ValueTest["value"] {
  const text = draft.trim();
  if (text === "true" || text === "false") return text === "true";
  return text !== "" && Number.isFinite(Number(text)) ? Number(text) : draft;
}

function BreakpointField({ of, text, why, ends, action, on }: FieldProps) {
  const { doc } = useEditorContext();
  const own = readBreakpoint(text);
  const write = (part: Partial<Breakpoint>) =>
    setBreakpoint(doc, of, { ...(own ?? PLAIN), ...part });
  const after = on === "arrow" || (own?.outcomes.length ?? 0) > 0;
  const description =
    why ??
    (on === "arrow"
      ? "A led run waits when it goes on here, before the next action begins."
      : "A led run waits before this action begins, or after its end.");
  return (
    <section className={formStyle.section} aria-label="Breakpoint">
      <div className={formStyle.heading}>
        <h2>Breakpoint</h2>
      </div>
      <SharedField of={of} field="breakpoint">
        <Switch
          label="Wait here"
          description={description}
          checked={own !== null}
          disabled={own === null && why !== null}
          onChange={(event) => setBreakpoint(doc, of, event.currentTarget.checked ? PLAIN : null)}
        />
        {own !== null && (
          <div className={style.conditions}>
            {on === "action" && (
              <NativeSelect
                label="Waits"
                value={after ? "after" : "before"}
                data={[
                  { value: "before", label: "before it begins" },
                  { value: "after", label: "after it has ended" },
                ]}
                onChange={(event) =>
                  write({
                    outcomes: event.currentTarget.value === "after" ? ENDS : [],
                    value: null,
                  })
                }
              />
            )}
            {after && ends.length > 1 && (
              <fieldset className={style.ends}>
                <legend>When it ended</legend>
                {ends.map((end) => (
                  <Checkbox
                    key={end}
                    label={end}
                    checked={own.outcomes.length === 0 || own.outcomes.includes(end)}
                    onChange={(event) => {
                      const now = own.outcomes.length === 0 ? ends : own.outcomes;
                      const next = event.currentTarget.checked
                        ? ends.filter((each) => each === end || now.includes(each))
                        : now.filter((each) => each !== end);
                      if (next.length === 0) return;
                      const all = on === "arrow" && next.length === ends.length;
                      write({ outcomes: all ? [] : next });
                    }}
                  />
                ))}
              </fieldset>
            )}
            <DraftInput
              label="Only at visit"
              placeholder="each"
              value={own.visit === 0 ? "" : String(own.visit)}
              inputMode="decimal"
              check={wholeVisit}
              onCommit={(draft) => write({ visit: Number(draft) })}
            />
            <ValueField own={own} names={action ? valueNames(action, after) : []} onWrite={write} />
          </div>
        )}
      </SharedField>
    </section>
  );
}

interface ValueProps {
  own: Breakpoint;
  names: readonly string[];
  onWrite: (part: Partial<Breakpoint>) => boolean;
}

function ValueField({ own, names, onWrite }: ValueProps) {
  const { value } = own;
  if (names.length === 0 && value === null) return null;
  const known = value === null || names.includes(value.name) ? names : [value.name, ...names];
  return (
    <div className={style.value}>
      <NativeSelect
        label="Only if"
        aria-label="Only if this value"
        value={value?.name ?? ""}
        data={[{ value: "", label: "any value" }, ...known]}
        onChange={(event) => {
          const name = event.currentTarget.value;
          onWrite({ value: name === "" ? null : { test: "==", value: 0, ...value, name } });
        }}
      />
      {value !== null && (
        <>
          <NativeSelect
            aria-label="Comparison"
            value={value.test}
            data={[...TESTS]}
            onChange={(event) =>
              onWrite({ value: { ...value, test: event.currentTarget.value as Test } })
            }
          />
          <DraftInput
            label=""
            ariaLabel="Value"
            value={String(value.value)}
            onCommit={(draft) => onWrite({ value: { ...value, value: typedValue(draft) } })}
          />
        </>
      )}
    </div>
  );
}

export function ActionBreakpoint({ action }: { action: Action }) {
  return (
    <BreakpointField
      of={action.key}
      text={action.breakpoint}
      why={null}
      ends={ENDS}
      action={action}
      on="action"
    />
  );
}

export function ArrowBreakpoint({ relation }: { relation: Relation }) {
  const { graph } = useEditorContext();
  return (
    <BreakpointField
      of={relationId(relation)}
      text={relation.breakpoint}
      why={whyNoBreakpoint(relation)}
      ends={endsOn(relation)}
      action={graph.actions.find(({ key }) => key === relation.parent)}
      on="arrow"
    />
  );
}
