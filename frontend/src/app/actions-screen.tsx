/** The screen of actions: the bar stays as it is while one action after the other is opened. */
import { useState } from "react";
import { useLibrary } from "../api/library";
import { usePerson } from "../api/people";
import { ActionsPage } from "../library/actions-page";
import { useNewGraphs } from "./imports/new-graphs";
import { PageBar, PageFrame, useTitle } from "./page-frame";

const HERE = { display: "contents" };

/** Return the name of the open action; null if none is open. */
function useName(id: string | null): string | null {
  const known = useLibrary().data;
  if (id === null) return null;
  return known?.find(({ document }) => document === id)?.name ?? "Action";
}

export function ActionsScreen({ id }: { id: string | null }) {
  const { choose } = useNewGraphs();
  const { person } = usePerson();
  const name = useName(id);
  const [status, setStatus] = useState<HTMLElement | null>(null);
  const [people, setPeople] = useState<HTMLElement | null>(null);
  useTitle(name ?? "Actions");
  const crumbs =
    name === null
      ? [{ label: "Graphs", to: "/" }, { label: "Actions" }]
      : [{ label: "Actions", to: "/actions" }, { label: name }];
  return (
    <PageFrame>
      <PageBar
        at="actions"
        crumbs={crumbs}
        status={<span ref={setStatus} style={HERE} />}
        actions={<span ref={setPeople} style={HERE} />}
      />
      <ActionsPage id={id} person={person} slots={{ status, people }} onImport={choose} />
    </PageFrame>
  );
}
