/** Packages and their files, as folders have them. */
import { IconChevronRight, IconFile, IconPackage } from "@tabler/icons-react";
import { useState } from "react";
import type { PackageOutline } from "../api/packages";
import { isolated } from "../words/isolated";
import style from "./packages.module.css";

interface Props {
  packages: readonly PackageOutline[];
  /** The package and the file that are shown. */
  shown: string;
  path: string;
  onShow: (outline: PackageOutline, path: string) => void;
}

export function PackageTree({ packages, shown, path, onShow }: Props) {
  // The first is open, and so is each that somebody opens.
  const [opened, setOpened] = useState<ReadonlySet<string>>(new Set([shown]));
  const turn = (name: string) => {
    const next = new Set(opened);
    if (!next.delete(name)) next.add(name);
    setOpened(next);
  };
  return (
    <nav aria-label="Files of packages" className={style.tree}>
      <ul>
        {packages.map((outline) => {
          const open = opened.has(outline.package);
          return (
            <li key={outline.package}>
              <button
                type="button"
                aria-expanded={open}
                className={style.folder}
                title={`The package of ${isolated(outline.action)}`}
                onClick={() => turn(outline.package)}
              >
                <IconChevronRight size={14} aria-hidden />
                <IconPackage size={15} aria-hidden />
                <bdi>{outline.package}</bdi>
              </button>
              {open && (
                <ul>
                  {outline.files.map((file) => (
                    <li key={file}>
                      <button
                        type="button"
                        className={style.file}
                        aria-current={
                          outline.package === shown && file === path ? "true" : undefined
                        }
                        title={file}
                        onClick={() => onShow(outline, file)}
                      >
                        <IconFile size={14} aria-hidden />
                        <bdi>{file}</bdi>
                      </button>
                    </li>
                  ))}
                </ul>
              )}
            </li>
          );
        })}
      </ul>
    </nav>
  );
}
