/** One file of a package, as it would be written. */
import { Button, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconCopy, IconDownload } from "@tabler/icons-react";
import { errorText } from "../api/http";
import { packageDownload, usePackage } from "../api/packages";
import { copyText } from "../ui/copy-text";
import { isolated } from "../words/isolated";
import style from "./packages.module.css";

interface Props {
  graph: string;
  seq: number;
  name: string;
  path: string;
}

async function copy(path: string, text: string) {
  const done = await copyText(text);
  notifications.show({ message: done ? `${path} is copied.` : "The browser did not let it copy." });
}

export function PackageFiles({ graph, seq, name, path }: Props) {
  const contents = usePackage(graph, seq, name);
  const text = contents.data?.files.find((file) => file.path === path)?.text ?? "";
  return (
    <section aria-label={`${name}/${path}`} className={style.preview}>
      <div className={style.title}>
        <h3>
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
