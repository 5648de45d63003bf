/** The first screen: every graph. */
import { NamePrompt } from "../account/name-prompt";
import { Home } from "../library/home/home";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";
import { useNewGraphs } from "./imports/new-graphs";
import { PageBar, PageFrame } from "./page-frame";
import { useTitle } from "./use-title";

const KeptGraphs = lazyPart(() => import("./kept-graphs").then((part) => part.KeptGraphs));

export function HomeScreen() {
  const { create, choose } = useNewGraphs();
  useTitle("Graphs");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs" }]} />
      <Home
        onNew={create}
        onImport={choose}
        greeting={<NamePrompt />}
        kept={
          <PartBoundary>
            <KeptGraphs />
          </PartBoundary>
        }
      />
    </PageFrame>
  );
}
