/** The first screen: every graph. */
import { NamePrompt } from "../account/name-prompt";
import { Home } from "../home/home";
import { TryButton } from "../runs/start/try-button";
import { boundedPart } from "../ui/lazy-part";
import { useNewGraphs } from "./imports/new-graphs";
import { PageBar, PageFrame, useTitle } from "./page-frame";

const KeptGraphs = boundedPart(() => import("./kept-graphs").then((part) => part.KeptGraphs));

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
        kept={<KeptGraphs />}
        Try={TryButton}
      />
    </PageFrame>
  );
}
