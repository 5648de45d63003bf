/** The C++ package of one action beside its form: its files as they would be written now. */
import { Skeleton } from "@mantine/core";
import { useState } from "react";
import { errorText } from "../api/http";
import { type PackageRefusal, usePackagesAt } from "../api/packages";
import { PackageFiles, PackageTree } from "./package-tree";
import style from "./packages.module.css";

interface Props {
  /** The action's document. */
  graph: string;
  /** The moment on screen. */
  seq: number;
}

function Refusals({ refusals }: { refusals: readonly PackageRefusal[] }) {
  return (
    <section aria-label="Without a package" className={style.refusals} data-alone>
      <h3>There can be no package yet</h3>
      <ul>
        {refusals.map(({ place, reason }) => (
          <li key={`${place} ${reason}`}>
            <span>
              <bdi className="weight-600">{place || "an action without a name"}</bdi> {reason}
            </span>
          </li>
        ))}
      </ul>
    </section>
  );
}

export function PackagePane({ graph, seq }: Props) {
  const list = usePackagesAt(graph, seq);
  const [chosen, setChosen] = useState<string | null>(null);
  if (list.isError) return <p role="alert">{errorText(list.error)}</p>;
  if (list.data === undefined) return <Skeleton height={320} />;
  const [outline] = list.data.packages;
  if (outline === undefined) return <Refusals refusals={list.data.refusals} />;
  const own = `src/${outline.package}.cpp`;
  const path = chosen !== null && outline.files.includes(chosen) ? chosen : own;
  return (
    <div className={style.pane} aria-busy={list.isPlaceholderData}>
      <PackageTree
        key={outline.package}
        packages={[outline]}
        shown={outline.package}
        path={path}
        onShow={(_, file) => setChosen(file)}
      />
      <PackageFiles
        key={`files of ${outline.package}`}
        graph={graph}
        seq={list.data.seq}
        name={outline.package}
        path={path}
      />
    </div>
  );
}
