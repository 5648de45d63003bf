/** Chooses a site, where one runner at a time is told of; nothing with one runner. */
import { NativeSelect } from "@mantine/core";
import { type ReactNode, useState } from "react";
import { useLive } from "../api/page-link";

/** Return the chosen runner, at first that of the first site, and what chooses it. */
export function useSiteChoice(disabled = false): {
  runner: string | undefined;
  choice: ReactNode;
} {
  const { runner, now } = useLive();
  const [chosen, choose] = useState<string>();
  const choice = now.sites && (
    <NativeSelect
      label="Site"
      w="fit-content"
      disabled={disabled}
      data={now.sites.map(({ site }) => ({ value: site.url, label: site.name }))}
      value={chosen ?? runner ?? ""}
      onChange={(event) => choose(event.currentTarget.value)}
    />
  );
  return { runner: chosen ?? runner, choice };
}
