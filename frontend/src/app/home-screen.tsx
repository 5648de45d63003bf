/** The first screen: every graph. */
import { Home } from "../library/home";
import { useNewGraphs } from "./new-graphs";
import { PageBar, PageFrame } from "./page-frame";
import { useTitle } from "./use-title";

export function HomeScreen() {
  const { create, choose } = useNewGraphs();
  useTitle("Graphs");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs" }]} />
      <Home onNew={create} onImport={choose} />
    </PageFrame>
  );
}
