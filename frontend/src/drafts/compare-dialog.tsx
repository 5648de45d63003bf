/** What a draft did and what its graph did, since both were last one. */
import { Button, Modal, Skeleton } from "@mantine/core";
import { type GraphDraft, useMergePreview } from "../api/documents/drafts";
import { errorText } from "../api/http";
import style from "./drafts.module.css";
import { ToldChanges } from "./told-changes";

const NO_CHOICES = {};

function Body({ draft }: { draft: GraphDraft }) {
  const found = useMergePreview(draft.id, "origin", NO_CHOICES);
  if (found.isPending) return <Skeleton height={160} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  const { draft_did, origin_did, conflicts } = found.data;
  return (
    <>
      <div className={style.sides}>
        <section>
          <h3>In this draft</h3>
          <ToldChanges changes={draft_did} nothing="Nothing was changed." />
        </section>
        <section>
          <h3>
            Meanwhile in <bdi>{draft.origin_name || "the graph"}</bdi>
          </h3>
          <ToldChanges changes={origin_did} nothing="Nothing was changed." />
        </section>
      </div>
      {conflicts.length > 0 && (
        <p className={style.quiet}>
          Both changed {conflicts.map(({ what }) => what).join(", ")}. A merge asks whose counts.
        </p>
      )}
    </>
  );
}

export function CompareDialog({ draft, onClose }: { draft: GraphDraft; onClose: () => void }) {
  return (
    <Modal opened onClose={onClose} size="xl" title={<bdi>{draft.name}</bdi>}>
      <Body draft={draft} />
      <div className={style.answers}>
        <Button onClick={onClose}>Close</Button>
      </div>
    </Modal>
  );
}
