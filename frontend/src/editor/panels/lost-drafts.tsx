/**
 * Tells when others delete something that this person is typing in or has just renamed, and offers
 * the text back.
 */
import { Button, Group } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useEffect, useMemo, useRef } from "react";
import { usePerson } from "../../api/people";
import { useEditorContext } from "../../edit-actions/editor-context";
import { type Deleted, Deletions } from "../../graph/edit/deletions";
import { announcer } from "../../ui/announcer";
import { copyText } from "../../ui/copy-text";
import { pendingDrafts } from "../../ui/drafts";
import { keptTexts, textScope } from "../../ui/kept-texts";
import style from "./lost-drafts.module.css";

interface OfferProps {
  id: string;
  text: string | null;
  deleted: Deleted | null;
  onRestore: () => void;
}

function Offer({ id, text, deleted, onRestore }: OfferProps) {
  return (
    <>
      {text !== null && (
        <>
          <p>What you typed:</p>
          <blockquote className={style.text}>
            <bdi>{text}</bdi>
          </blockquote>
        </>
      )}
      <Group gap="xs" mt="xs">
        {deleted !== null && (
          <Button
            size="compact-sm"
            onClick={() => {
              notifications.hide(id);
              onRestore();
            }}
          >
            {text === null ? "Restore it" : "Restore it with the text"}
          </Button>
        )}
        {text !== null && (
          <Button size="compact-sm" variant="subtle" onClick={() => void copyText(text)}>
            Copy the text
          </Button>
        )}
      </Group>
    </>
  );
}

const offerId = (deleted: Deleted | null, text: string | null) =>
  `lost-${deleted?.key ?? "draft"}-${text ?? ""}`;

/** Shows the notification. `name`: the deleted element, before the words. */
function offer(name: string, words: string, props: Omit<OfferProps, "id">): void {
  const id = offerId(props.deleted, props.text);
  notifications.hide(id);
  notifications.show({
    id,
    color: "orange",
    title: (
      <>
        <bdi>{name}</bdi> {words}
      </>
    ),
    message: <Offer id={id} {...props} />,
    autoClose: false,
  });
  announcer.say(`${name} ${words}`);
}

const WORDS = {
  gone: "The field you typed in was deleted",
  unfit: "Not written: it did not fit its field",
  written: null, // it was written and still exists
} as const;

/** Watches deletions of others while the graph is open. */
export function LostDrafts() {
  const { doc, mayEdit, id: graph } = useEditorContext();
  const { person } = usePerson();
  const may = useRef(mayEdit);
  may.current = mayEdit;
  const deletions = useMemo(() => new Deletions(doc, () => may.current), [doc]);
  useEffect(() => {
    deletions.open();
    // One element may have lost several texts: whoever restores it is not asked about the others.
    const offered = new Map<string, Map<string, () => void>>();
    const restoring = (deleted: Deleted | null, text: string | null, then: () => void) => {
      if (deleted === null) return then;
      const { key } = deleted;
      const all = offered.get(key) ?? new Map<string, () => void>();
      offered.set(key, all.set(offerId(deleted, text), then));
      return () => {
        offered.delete(key);
        deletions.restore(key);
        for (const [id, write] of all) {
          notifications.hide(id);
          write();
        }
      };
    };
    const stops = [
      pendingDrafts.onLost((lost) => {
        const deleted = lost.of === null ? null : deletions.of(lost.of);
        const words = deleted === null ? WORDS[lost.why] : "was deleted while you typed";
        if (words === null) return;
        const { text } = lost;
        offer(deleted?.name ?? "", words, {
          text,
          deleted,
          onRestore: restoring(deleted, text, () => void lost.write()),
        });
      }),
      deletions.onRenamedMeanwhile((deleted) =>
        offer(deleted.name, "was deleted while it was renamed", {
          text: null,
          deleted,
          onRestore: restoring(deleted, null, () => undefined),
        }),
      ),
      deletions.onDeleted((deleted) => {
        const key = `${textScope(graph, person.id)}comment/${deleted.key}`;
        const text = keptTexts.get(key);
        if (text === "") return;
        keptTexts.set(key, "");
        const onRestore = restoring(deleted, text, () => keptTexts.set(key, text));
        offer(deleted.name, "was deleted while you wrote a comment", { text, deleted, onRestore });
      }),
    ];
    return () => {
      for (const stop of stops) stop();
      deletions.close();
    };
  }, [deletions, graph, person.id]);
  return null;
}
