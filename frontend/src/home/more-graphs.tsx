/** The end of a list of graphs of which there are more: they come when one is near, or by a button. */
import { Button } from "@mantine/core";
import { useEffect, useRef } from "react";
import type { GraphPages } from "../api/graph-list";
import style from "./home.module.css";

const NEAR = "600px 0px"; // they are loaded before one has reached the end

export function MoreGraphs({ pages }: { pages: GraphPages }) {
  const end = useRef<HTMLDivElement>(null);
  const load = useRef(pages.more);
  load.current = pages.more;
  const count = pages.graphs?.length ?? 0;
  // Watched anew after each page: the end may still be near then.
  // biome-ignore lint/correctness/useExhaustiveDependencies: see above
  useEffect(() => {
    const near = new IntersectionObserver(([each]) => each?.isIntersecting && load.current(), {
      rootMargin: NEAR,
    });
    if (end.current) near.observe(end.current);
    return () => near.disconnect();
  }, [count]);
  if (!pages.hasMore) return null;
  return (
    <div ref={end} className={style.foot}>
      <Button variant="subtle" color="gray" loading={pages.isLoadingMore} onClick={pages.more}>
        More graphs ({count} of {pages.total})
      </Button>
    </div>
  );
}
