/** The C++ packages of a graph's actions: what is in them before anything is downloaded. */
import { Button, Modal, Skeleton } from "@mantine/core";
import { IconDownload } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import {
  type PackageList,
  type PackageOutline,
  type PackageRefusal,
  packageDownload,
  usePackages,
} from "../api/packages";
import type { EditorContext } from "../edit-actions/editor-context";
import { PackageFiles, PackageTree } from "./package-tree";
import style from "./packages.module.css";

interface Props {
  context: EditorContext;
  /** The name of the action whose package is shown first. */
  action?: string;
  onClose: () => void;
}

/** The one that is shown: the file that a developer fills in, unless somebody chose another. */
interface ShownFile {
  package: PackageOutline;
  path: string;
}

const sourceOf = (outline: PackageOutline) => `src/${outline.package}.cpp`;

function firstShown({ packages }: PackageList, action: string | undefined): ShownFile | null {
  const outline = packages.find((each) => each.action === action) ?? packages[0];
  return outline === undefined ? null : { package: outline, path: sourceOf(outline) };
}

export function PackagesDialog({ context, action, onClose }: Props) {
  const list = usePackages(context.id);
  return (
    <Modal opened onClose={onClose} title="C++ packages" size="72rem">
      {list.isPending && <Skeleton height={320} />}
      {list.isError && <p role="alert">{errorText(list.error)}</p>}
      {list.data && <Listed list={list.data} context={context} action={action} onClose={onClose} />}
    </Modal>
  );
}

interface ListedProps {
  list: PackageList;
  context: EditorContext;
  action: string | undefined;
  onClose: () => void;
}

function Listed({ list, context, action, onClose }: ListedProps) {
  const [chosen, setChosen] = useState<ShownFile | null>(null);
  const shown = chosen ?? firstShown(list, action);
  const { packages, refusals, seq } = list;
  const count = packages.length;
  return (
    <div className={style.whole}>
      <div className={style.head}>
        <p>
          {count === 0
            ? "No action of this graph can have a package yet."
            : "As engines load them: unzip into the src folder of a workspace, fill in onRun, build."}
        </p>
        {count > 0 && (
          <Button
            component="a"
            href={packageDownload(context.id, seq)}
            download="action_packages.zip"
            leftSection={<IconDownload size={16} aria-hidden />}
          >
            {count === 1 ? "Download" : `Download all ${count}`}
          </Button>
        )}
      </div>
      <PackageRefusals refusals={refusals} context={context} onClose={onClose} />
      {shown && (
        <div className={style.panes}>
          <PackageTree
            packages={packages}
            shown={shown.package.package}
            path={shown.path}
            onShow={(outline, path) => setChosen({ package: outline, path })}
          />
          <PackageFiles
            key={shown.package.package}
            graph={context.id}
            seq={seq}
            name={shown.package.package}
            path={shown.path}
          />
        </div>
      )}
    </div>
  );
}

interface PackageRefusalsProps {
  refusals: readonly PackageRefusal[];
  context: EditorContext;
  onClose: () => void;
}

export function PackageRefusals({ refusals, context, onClose }: PackageRefusalsProps) {
  if (refusals.length === 0) return null;
  const show = (name: string) => {
    const keys = context.graph.actions
      .filter((action) => action.name === name && !action.missing)
      .map((action) => action.key);
    onClose();
    context.select(keys);
    context.view.show(keys);
  };
  return (
    <section aria-label="Without a package" className={style.refusals}>
      <h3>
        {refusals.length === 1
          ? "One reason prevents a package"
          : `${refusals.length} reasons prevent packages`}
      </h3>
      <ul>
        {refusals.map(({ action, place, reason }) => (
          <li key={`${place} ${reason}`}>
            <span>
              <bdi className="weight-600">{place || "an action without a name"}</bdi> {reason}
            </span>
            <Button variant="default" size="compact-sm" onClick={() => show(action)}>
              Show<span className="visually-hidden"> {action || "it"}</span>
            </Button>
          </li>
        ))}
      </ul>
    </section>
  );
}
