/** How long a visit took, in words: exactly, or between two bounds where its ends were not seen. */
import type { Progress } from "../api/progress";
import { duration } from "./when";

export function tookWords(progress: Pick<Progress, "took" | "atMost">): string | null {
  const { took, atMost } = progress;
  if (took === null || (took === 0 && atMost === null)) return null; // seen in one message only
  const [least, most] = [duration(took), atMost === null ? "" : duration(atMost)];
  if (most === "" || most === least) return least;
  if (took < 50) return `≤ ${most}`;
  const unit = least.endsWith(" s") && most.endsWith(" s") ? " s" : "";
  return `${least.slice(0, least.length - unit.length)}–${most}`;
}

/** The same beside a word of state. */
export function moreOf(progress: Pick<Progress, "took" | "atMost">): { more?: string } {
  const words = tookWords(progress);
  return words === null ? {} : { more: words };
}
