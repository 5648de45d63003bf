/** Shows above the canvas of a draft its origin, how far both are apart, and what can be done. */
import { Button, Modal, Textarea } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { IconGitBranch } from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import {
  type GraphDraft,
  proposeDraft,
  useDraft,
  useDraftOf,
  withdrawProposal,
} from "../api/drafts";
import { usePerson } from "../api/people";
import { useEditorContext } from "../edit-actions/editor-context";
import { useThrottledLink } from "../sync/use-room";
import { textScope, useKeptText } from "../ui/kept-texts";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { answersWords, apartWords, useDraftStep } from "./draft-steps";
import style from "./drafts.module.css";

const MergeDialog = lazyPart(() => import("./merge-dialog").then((part) => part.MergeDialog));
const CompareDialog = lazyPart(() => import("./merge-dialog").then((part) => part.CompareDialog));

/** Delay after the last edit before the differences are asked for, ms. */
const SETTLED_MS = 800;

type Dialog = "compare" | "merge" | "take-over" | "propose";

function Dialogs({
  draft,
  open,
  onClose,
}: {
  draft: GraphDraft;
  open: Dialog;
  onClose: () => void;
}) {
  return (
    <OverlayBoundary>
      {open === "compare" && <CompareDialog draft={draft} onClose={onClose} />}
      {open === "propose" && <ProposeDialog draft={draft} onClose={onClose} />}
      {open === "merge" && <MergeDialog draft={draft} into="origin" onClose={onClose} />}
      {open === "take-over" && <MergeDialog draft={draft} into="draft" onClose={onClose} />}
    </OverlayBoundary>
  );
}

function Proposal({ draft }: { draft: GraphDraft }) {
  const { busy, wrong, step } = useDraftStep();
  const { proposal } = draft;
  if (!proposal) return null;
  return (
    <>
      <span className="ink2">Proposed: {answersWords(proposal, draft.seq)}</span>
      <Button
        size="compact-sm"
        variant="subtle"
        loading={busy}
        onClick={() => void step(() => withdrawProposal(draft.id))}
      >
        Withdraw
      </Button>
      {wrong !== "" && <span role="alert">{wrong}</span>}
    </>
  );
}

interface StepsProps {
  draft: GraphDraft;
  onOpen: (dialog: Dialog) => void;
}

function Steps({ draft, onOpen }: StepsProps) {
  const { mayEdit } = useEditorContext();
  const { ahead, behind } = draft;
  const known = ahead !== null && behind !== null;
  return (
    <div className="wrap gap-6px">
      <Button size="compact-sm" disabled={!known} onClick={() => onOpen("compare")}>
        Compare
      </Button>
      {mayEdit && known && behind > 0 && (
        <Button size="compact-sm" onClick={() => onOpen("take-over")}>
          Take over…
        </Button>
      )}
      {mayEdit && known && ahead > 0 && !draft.proposal && (
        <Button size="compact-sm" onClick={() => onOpen("propose")}>
          Propose…
        </Button>
      )}
      {mayEdit && (
        <Button
          size="compact-sm"
          variant="filled"
          disabled={!known || ahead === 0}
          onClick={() => onOpen("merge")}
        >
          Merge…
        </Button>
      )}
    </div>
  );
}

function Bar({ id }: { id: string }) {
  const [seq] = useDebouncedValue(useThrottledLink().seq, SETTLED_MS);
  const [open, setOpen] = useState<Dialog | null>(null);
  const draft = useDraft(id, seq).data;
  if (!draft) return null;
  return (
    <section className={style.bar} aria-label="Draft">
      <IconGitBranch size={16} aria-hidden />
      <span className={style.words}>
        <b>
          Draft “<bdi>{draft.name}</bdi>”
        </b>{" "}
        of{" "}
        <Link to={`/graphs/${draft.origin}`}>
          <bdi>{draft.origin_name || "Untitled"}</bdi>
        </Link>
        <span className={style.apart}>
          {draft.ahead === null
            ? "which was deleted"
            : draft.state === "merged" && draft.behind === 0
              ? "merged"
              : apartWords(draft)}
        </span>
      </span>
      <Proposal draft={draft} />
      <Steps draft={draft} onOpen={setOpen} />
      {open !== null && <Dialogs draft={draft} open={open} onClose={() => setOpen(null)} />}
    </section>
  );
}

/** Bar above the canvas of a draft; renders nothing for other graphs. */
export function DraftBar({ id }: { id: string }) {
  const of = useDraftOf(id).data;
  return of ? <Bar id={id} /> : null;
}

export function ProposeDialog({ draft, onClose }: { draft: GraphDraft; onClose: () => void }) {
  const { person } = usePerson();
  const [note, setNote] = useKeptText(`${textScope(draft.id, person.id)}proposal`);
  const { busy, wrong, step } = useDraftStep();
  const propose = () =>
    step(async () => {
      await proposeDraft(draft.id, note);
      setNote("");
      onClose();
    });
  const cancel = () => {
    setNote("");
    onClose();
  };
  return (
    <Modal opened onClose={onClose} title={<bdi>Propose “{draft.name}”</bdi>}>
      <Textarea
        label="What is it for?"
        description="Others see this text in the history of the graph, look at the draft, and answer yes or no."
        autosize
        minRows={3}
        maxLength={2000}
        data-autofocus
        value={note}
        error={wrong || undefined}
        onChange={(event) => setNote(event.currentTarget.value)}
      />
      <div className={style.answers}>
        <Button onClick={cancel}>Cancel</Button>
        <Button variant="filled" loading={busy} onClick={() => void propose()}>
          Propose
        </Button>
      </div>
    </Modal>
  );
}
