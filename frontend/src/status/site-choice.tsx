/** Chooses a site, where one runner at a time is told of; nothing with one runner. */
import { NativeSelect } from "@mantine/core";
import { type ReactNode, useState } from "react";
import { useLive } from "../api/page-link";

/** Return the chosen runner, at first `at`, else that of the first site, and what chooses it. */
export function useSiteChoice(at?: string): {
  runner: string | undefined;
  choice: ReactNode;
} {
  const { runner, now } = useLive();
  const [chosen, choose] = useState(at);
  const choice = now.sites && (
    <NativeSelect
      label="Site"
      w="fit-content"
      data={now.sites.map(({ site }) => ({ value: site.url, label: site.name }))}
      value={chosen ?? runner ?? ""}
      onChange={(event) => choose(event.currentTarget.value)}
    />
  );
  return { runner: chosen ?? runner, choice };
}
