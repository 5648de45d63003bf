/** The screen of whoever looks after the installation. */
import { AdministrationPage } from "../administration/administration-page";
import { PageBar, PageFrame } from "./page-frame";
import { useTitle } from "./use-title";

export function AdministrationScreen() {
  useTitle("Administration");
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: "Administration" }]} />
      <AdministrationPage />
    </PageFrame>
  );
}
