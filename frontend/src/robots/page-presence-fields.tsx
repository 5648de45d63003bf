/** Fields in which an owner writes how long the page of whoever runs something on a robot may be missing. */
import { Group, NumberInput, Stack, Switch } from "@mantine/core";
import { useState } from "react";
import type { PagePresence } from "../api/rights";
import { usePendingText } from "../ui/drafts";

const NEW: PagePresence = { wait_s: 10, stop_s: 60 };

interface Props {
  page: PagePresence | null;
  onChange: (page: PagePresence | null) => void;
}

export function PagePresenceFields({ page, onChange }: Props) {
  const [before] = useState(page);
  usePendingText(page === before || page === null ? "" : `${page.wait_s} ${page.stop_s}`, null);
  const put = (change: Partial<PagePresence>) => onChange({ ...(page ?? NEW), ...change });
  const seconds = (value: string | number, before: number) =>
    typeof value === "number" ? value : before;
  return (
    <Stack gap="xs">
      <Switch
        label="The operator's page stays visible"
        description="No enabling device and no safety function: a visible window does not show that somebody looks. It is a page of whoever started the run or holds the baton; no background tab, viewer or program counts. A run that the engine got whole cannot wait: it is only stopped. A page that comes back starts nothing."
        checked={page !== null}
        onChange={(event) => onChange(event.currentTarget.checked ? NEW : null)}
      />
      {page !== null && (
        <Group grow align="end">
          <NumberInput
            size="xs"
            label="A led run waits after (s)"
            min={3}
            max={3600}
            value={page.wait_s}
            onChange={(value) => put({ wait_s: seconds(value, page.wait_s) })}
          />
          <NumberInput
            size="xs"
            label="Any run: Stop after (s)"
            min={3}
            max={3600}
            value={page.stop_s}
            onChange={(value) => put({ stop_s: seconds(value, page.stop_s) })}
          />
        </Group>
      )}
    </Stack>
  );
}
