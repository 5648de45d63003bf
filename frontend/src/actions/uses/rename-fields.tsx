/** What may only be called otherwise: asked, and never taken for granted. */
import { Checkbox, NativeSelect } from "@mantine/core";
import { pathWords } from "../../graph/value-text";
import { isolated } from "../../words/isolated";
import style from "./update-dialog.module.css";
import type { Update } from "./use-update";

type Rename = Update["possible"][number];

const nameOf = ({ side, from }: Rename): string =>
  `${side === "in" ? "" : "output "}${pathWords(from)}`;

/** For each that went, what it may be called now. */
function Others({ update }: { update: Update }) {
  const names = [...new Set(update.possible.map(nameOf))];
  if (names.length === 0) return null;
  return (
    <details className={style.others}>
      <summary>
        {update.suggested.length > 0 ? "Something else is" : "Say what is"} only called otherwise
      </summary>
      {names.map((name) => {
        const choices = update.possible.filter((each) => nameOf(each) === name);
        return (
          <NativeSelect
            key={name}
            label={`${isolated(name)} is`}
            disabled={update.busy}
            value={choices.find(({ ticked }) => ticked)?.key ?? ""}
            data={[
              { value: "", label: "gone" },
              ...choices.map(({ key, to, ticked, clashes }) => ({
                value: key,
                label: `now ${pathWords(to)}`,
                disabled: clashes && !ticked && !choices.some((other) => other.ticked),
              })),
            ]}
            onChange={(event) =>
              update.choose(
                choices.map(({ key }) => key),
                event.currentTarget.value,
              )
            }
          />
        );
      })}
    </details>
  );
}

export function RenameChoices({ update }: { update: Update }) {
  if (update.suggested.length + update.possible.length === 0) return null;
  return (
    <fieldset className={style.renames}>
      <legend>Only called otherwise? Then its value is kept under the new name.</legend>
      {update.suggested.map((each) => (
        <Checkbox
          key={each.key}
          label={`${isolated(nameOf(each))} is now ${pathWords(each.to)}`}
          checked={each.ticked}
          disabled={update.busy || (each.clashes && !each.ticked)}
          onChange={() => update.tick(each.key)}
        />
      ))}
      <Others update={update} />
    </fieldset>
  );
}
