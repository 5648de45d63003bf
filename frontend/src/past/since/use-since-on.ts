/** Whether cards and arrows that changed since the last good run are marked; kept on the device. */
import { useLocalStorage } from "@mantine/hooks";

export function useSinceOn() {
  return useLocalStorage({
    key: "aa.since-marks",
    defaultValue: true,
    getInitialValueInEffect: false,
  });
}
