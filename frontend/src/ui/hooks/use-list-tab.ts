/** Which list the sidebar shows, on this device: whoever changes it, all that shows it follows. */
import { useLocalStorage } from "@mantine/hooks";

export type ListTab = "graphs" | "actions";

export function useListTab() {
  return useLocalStorage<ListTab>({
    key: "aa.list-tab",
    defaultValue: "graphs",
    getInitialValueInEffect: false,
  });
}
