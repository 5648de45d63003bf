/** What became of files that were taken in, told in few messages however many there were. */

import { Button } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { tick } from "../../clock/server-clock";
import { type KnownFile, replaceKnown, type TakenFiles } from "./take-files";

const MOST_TOLD = 5;
const PROGRESS = "files-taken";

/** After a second: few files are taken before anybody has read it. */
export function progressOf(count: number): { tell: (done: number) => void; end: () => void } {
  let shown = false;
  const start = tick();
  const tell = (done: number) => {
    const message = `${done} of ${count} files`;
    if (shown) notifications.update({ id: PROGRESS, message, loading: true, autoClose: false });
    else if (tick() - start > 700) {
      shown = true;
      notifications.show({
        id: PROGRESS,
        title: "Importing",
        message,
        loading: true,
        autoClose: false,
        withCloseButton: false,
      });
    }
  };
  return { tell, end: () => shown && notifications.hide(PROGRESS) };
}

function complain(failed: readonly string[]): void {
  if (failed.length === 0) return;
  const more = failed.length - MOST_TOLD;
  notifications.show({
    color: "red",
    title: failed.length === 1 ? "A file was not imported" : `${failed.length} files were not`,
    message: [...failed.slice(0, MOST_TOLD), ...(more > 0 ? [`and ${more} more`] : [])].join("\n"),
    autoClose: 15_000,
    style: { whiteSpace: "pre-line" },
  });
}

/** Asked, since others may have edited them; the history leads back. */
function offerReplacing(known: readonly KnownFile[], after: () => void): void {
  if (known.length === 0) return;
  const id = `known-${known.map(({ document }) => document).join(" ")}`;
  const replace = async () => {
    notifications.hide(id);
    complain(await replaceKnown(known));
    after();
  };
  notifications.show({
    id,
    title:
      known.length === 1
        ? `${known[0]?.file} is of an action that the library has`
        : `The library has ${known.length} of these actions already`,
    message: (
      <Button size="compact-sm" mt="xs" onClick={() => void replace()}>
        Make them what the files say
      </Button>
    ),
    autoClose: false,
  });
}

/** `after`: the lists are read again. */
export function tellTaken({ taken, known, failed }: TakenFiles, after: () => void): void {
  complain(failed);
  offerReplacing(known, after);
  const actions = taken.filter(({ kind }) => kind === "action").length;
  if (actions > 1) {
    notifications.show({ message: `${actions} actions are in the library now.` });
  }
}

/** Where one goes after an import: to what came last, to the list when many actions came. */
export function placeAfter({ taken, known }: Pick<TakenFiles, "taken" | "known">): string | null {
  const last = taken.at(-1);
  if (last === undefined) {
    return known.length === 1 ? `/actions/${known[0]?.document}` : null;
  }
  if (last.kind === "graph") return `/graphs/${last.made.id}`;
  return taken.length === 1 ? `/actions/${last.made.id}` : "/actions";
}
