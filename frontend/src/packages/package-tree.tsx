/** Packages and their files, as folders have them. */

import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import {
  IconChevronRight,
  IconCopy,
  IconDownload,
  IconFile,
  IconPackage,
} from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import { type PackageOutline, packageDownload, usePackage } from "../api/packages";
import { copyText } from "../ui/copy-text";
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

interface PackageFilesProps {
  graph: string;
  seq: number;
  name: string;
  path: string;
}

async function copy(path: string, text: string) {
  const done = await copyText(text);
  notifications.show({
    message: done ? `${path} is copied.` : "The browser did not allow copying.",
  });
}

export function PackageFiles({ graph, seq, name, path }: PackageFilesProps) {
  const contents = usePackage(graph, seq, name);
  const text = contents.data?.files.find((file) => file.path === path)?.text ?? "";
  return (
    <section aria-label={`${name}/${path}`} className="stack min-w-0 min-h-0 gap-50">
      <div className={style.title}>
        <h3 className="m-0 fill truncate text-13">
          <bdi>
            {name}/{path}
          </bdi>
        </h3>
        <Button
          variant="default"
          size="compact-sm"
          leftSection={<IconCopy size={14} aria-hidden />}
          disabled={!contents.isSuccess}
          onClick={() => void copy(path, text)}
        >
          Copy
        </Button>
        <Button
          component="a"
          variant="default"
          size="compact-sm"
          href={packageDownload(graph, seq, name)}
          download={`${name}.zip`}
          leftSection={<IconDownload size={14} aria-hidden />}
        >
          Download {isolated(name)}
        </Button>
      </div>
      {contents.isPending && <Skeleton height={240} />}
      {contents.isError && <p role="alert">{errorText(contents.error)}</p>}
      {contents.isSuccess && (
        // biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls is reached by keys
        <pre tabIndex={0} className={style.text}>
          {text}
        </pre>
      )}
    </section>
  );
}
