/** The rights and the life of a token, as a person chooses them. */
import { Checkbox, NativeSelect, Text } from "@mantine/core";
import { usePerson } from "../api/people";
import { may, type Permission, ROLE_WORDS } from "../api/session";
import { counted } from "../words/counted";
import style from "./programs.module.css";
import { completed, OPERATE_WORDS, SCOPES, type Scope } from "./tokens";

const PERMISSION = {
  read: "see",
  edit: "edit",
  simulate: "simulate",
  operate: "operate",
  scrape: "see",
} as const satisfies Record<(typeof SCOPES)[number]["scope"], Permission>;

interface ScopeProps {
  /** The scopes that can be chosen. */
  offered: readonly Scope[];
  chosen: readonly Scope[];
  onChange: (chosen: Scope[]) => void;
}

/** Return the scopes that this person can give. */
export function useGivable(): Scope[] {
  const { role } = usePerson().person;
  return SCOPES.map(({ scope }) => scope).filter((scope) => may(role, PERMISSION[scope]));
}

export function ScopeFields({ offered, chosen, onChange }: ScopeProps) {
  const givable = useGivable();
  const { role } = usePerson().person;
  const shown = SCOPES.filter(({ scope }) => offered.includes(scope));
  const all = completed(chosen);
  const lacks = shown.filter(({ scope }) => !givable.includes(scope));
  return (
    <fieldset className={style.scopes}>
      <legend>It may</legend>
      {shown.map(({ scope, label }) => (
        <Checkbox
          key={scope}
          label={
            <>
              {label} <code>{scope}</code>
            </>
          }
          checked={all.includes(scope)}
          disabled={!givable.includes(scope) || (all.includes(scope) && !chosen.includes(scope))}
          onChange={(event) =>
            onChange(
              event.currentTarget.checked
                ? [...chosen, scope]
                : chosen.filter((each) => each !== scope),
            )
          }
        />
      ))}
      {lacks.length > 0 && (
        <Text size="sm" c="dimmed">
          You are here as {role}: you may {ROLE_WORDS[role]}, and so may your programs at most.
        </Text>
      )}
      {all.includes("operate") && (
        <p className={style.warning} role="note">
          {OPERATE_WORDS}
        </p>
      )}
    </fieldset>
  );
}

const LIVES = [1, 7, 30, 90, 365] as const;

interface LifeProps {
  days: number;
  most: number;
  onChange: (days: number) => void;
}

export function LifeField({ days, most, onChange }: LifeProps) {
  const lives = [...new Set([...LIVES.filter((each) => each <= most), days])].sort((a, b) => a - b);
  return (
    <NativeSelect
      label="For"
      data={lives.map((each) => ({ value: String(each), label: counted(each, "day") }))}
      value={String(days)}
      onChange={(event) => onChange(Number(event.currentTarget.value))}
    />
  );
}
