/** How large the screen is, in the two steps that the page knows, and what points at it. */
import { useMediaQuery } from "@mantine/hooks";

const AT_ONCE = { getInitialValueInEffect: false };

/** Room for the list, the canvas and the details side by side. */
export function useIsWide(): boolean {
  return useMediaQuery("(min-width: 1101px)", true, AT_ONCE);
}

/** One thing at a time. */
export function useIsPhone(): boolean {
  return useMediaQuery("(max-width: 600px)", false, AT_ONCE);
}

/** Nothing that hovers: there is no mouse, and most likely no keyboard. */
export function useHasFingersOnly(): boolean {
  return useMediaQuery("(pointer: coarse) and (hover: none)", false, AT_ONCE);
}
