/** Names for the links that are written in a note. Loaded late: who writes is not kept waiting. */
import type { ComponentProps } from "react";
import { lazyPart } from "../../ui/parts/lazy-part";
import { PartBoundary } from "../../ui/parts/part-boundary";

const LinkCompletion = lazyPart(() =>
  import("./link-completion").then((part) => part.LinkCompletion),
);
const nothing = () => null;

export function LinkNames(props: ComponentProps<typeof LinkCompletion>) {
  return (
    <PartBoundary frame={nothing} waiting={null}>
      <LinkCompletion {...props} />
    </PartBoundary>
  );
}
