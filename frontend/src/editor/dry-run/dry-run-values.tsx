/** The values with which a dry-run is played: asked for as the start dialog does, and never sent to a robot. */
import { Button, Popover } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { IconForms } from "@tabler/icons-react";
import { useEffect, useMemo, useState } from "react";
import { type StartValues, useEarlierValues } from "../../api/starts";
import type { DryRun } from "../../dry-run/use-dry-run";
import {
  type Drafts,
  firstDrafts,
  missingWords,
  proposalsFor,
  typedValues,
} from "../../status/start-values";
import { StartValuesForm } from "../../status/start-values-form";
import { counted } from "../../words/counted";
import style from "./dry-run-bar.module.css";

const TYPING = 400; // ms without a key until it is played with what was typed

interface Props {
  /** The id of the graph. */
  graph: string;
  run: DryRun;
}

/** Keeps what is typed, and plays with all of it that is a value. */
function useGivenValues({ graph, run: { asked, seed, given, give } }: Props) {
  const earlier = useEarlierValues(graph, asked.length > 0);
  const [edited, edit] = useState<Drafts>(given?.edited ?? {});
  const started = seed?.started;
  const before = earlier.data ?? null;
  const drafts = useMemo(
    () => ({ ...firstDrafts(asked, started, before?.values), ...edited }),
    [asked, started, before, edited],
  );
  const typed = useMemo(() => typedValues(asked, drafts), [asked, drafts]);
  const missing = missingWords(asked, drafts, typed.wrong);
  const [text] = useDebouncedValue(JSON.stringify(typed.values), TYPING);
  useEffect(() => {
    give({ values: JSON.parse(text) as StartValues, missing, edited });
  }, [give, text, missing, edited]);
  const change = (place: string, draft: string) => edit((now) => ({ ...now, [place]: draft }));
  return { drafts, wrong: typed.wrong, missing, change, started, before };
}

export function DryRunValues(props: Props) {
  const { asked } = props.run;
  const given = useGivenValues(props);
  const [opened, open] = useState<boolean | null>(null);
  if (asked.length === 0) return null;
  const { missing } = given;
  return (
    <Popover
      position="top-start"
      width="min(23rem, calc(100vw - 1rem))"
      withinPortal
      // What is missing is asked for at once; what has a value waits for a click.
      opened={opened ?? missing !== null}
      onChange={open}
    >
      <Popover.Target>
        <Button
          size="compact-sm"
          variant="light"
          color={missing === null ? "blue" : "orange"}
          leftSection={<IconForms size={14} aria-hidden />}
          aria-expanded={opened ?? missing !== null}
          onClick={() => open(!(opened ?? missing !== null))}
        >
          {missing ?? counted(asked.length, "value")}
        </Button>
      </Popover.Target>
      <Popover.Dropdown className={style.seed ?? ""}>
        <section aria-label="Values" onFocus={() => open(true)}>
          <StartValuesForm
            asked={asked}
            drafts={given.drafts}
            wrong={given.wrong}
            proposals={(each) => proposalsFor(each, given.started, given.before)}
            onChange={given.change}
          />
        </section>
      </Popover.Dropdown>
    </Popover>
  );
}
