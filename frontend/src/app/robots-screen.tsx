/** The screen of robots: what they hold can be taken as a graph. */
import { RobotsPage } from "../robots/robots-page";
import { useNewGraphs } from "./imports/new-graphs";
import { PageBar, PageFrame } from "./page-frame";
import { useTitle } from "./use-title";

export function RobotsScreen() {
  const { take } = useNewGraphs();
  useTitle("Robots");
  const onImport = (text: string, name: string) => {
    void take([new File([text], `${name}.umrf.graph.json`, { type: "application/json" })]);
  };
  return (
    <PageFrame>
      <PageBar at="robots" crumbs={[{ label: "Graphs", to: "/" }, { label: "Robots" }]} />
      <RobotsPage onImport={onImport} />
    </PageFrame>
  );
}
