/** Says that the server has another version of the page than the one that is shown. */
import { Button, CloseButton } from "@mantine/core";
import { useEffect, useState } from "react";
import style from "./new-version-notice.module.css";
import { watchVersion } from "./page-version";

export function NewVersionNotice() {
  const [shown, setShown] = useState(false);
  useEffect(() => watchVersion(() => setShown(true)), []);
  if (!shown) return null;
  return (
    <div className={style.notice} role="status">
      <span>The server was updated. This page still works; reload it to get the new version.</span>
      <Button size="compact-sm" onClick={() => location.reload()}>
        Reload
      </Button>
      <CloseButton aria-label="Not now" onClick={() => setShown(false)} />
    </div>
  );
}
