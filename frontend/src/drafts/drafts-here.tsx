/** The drafts of the open graph, above its history: proposals first, and a new one. */
import { ActionIcon, Button, Modal, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconCheck, IconGitBranch, IconTrash, IconX } from "@tabler/icons-react";
import { type QueryClient, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { Link, useLocation } from "wouter";
import { answerProposal, type GraphDraft, makeDraft, useDrafts } from "../api/drafts";
import { authorName, deleteGraph, refreshGraphs } from "../api/graphs";
import { usePerson } from "../api/people";
import { useEditorContext } from "../edit-actions/editor-context";
import { lazyPart, OverlayBoundary } from "../ui/lazy-part";
import { isolated } from "../words/isolated";
import { answersWords, apartWords, useDraftStep } from "./draft-steps";
import style from "./drafts.module.css";

const MergeDialog = lazyPart(() => import("./merge-dialog").then((part) => part.MergeDialog));

interface DraftRowProps {
  draft: GraphDraft;
  onMerge: () => void;
}

function ProposalOf({ draft, onMerge }: DraftRowProps) {
  const { mayEdit } = useEditorContext();
  const { busy, wrong, step } = useDraftStep();
  const { person } = usePerson();
  const { proposal } = draft;
  if (!proposal) return null;
  const mine = proposal.author.id === person.id;
  const say = (yes: boolean) =>
    void step(() => answerProposal(draft.id, { yes, seq: draft.seq, note: "" }));
  return (
    <div className={style.proposal}>
      {proposal.note !== "" && (
        <p>
          <bdi>{proposal.note}</bdi>
        </p>
      )}
      <p className={style.quiet}>
        Proposed by <bdi>{authorName(proposal.author)}</bdi>: {answersWords(proposal, draft.seq)}
      </p>
      {mayEdit && (
        <p className={style.quiet}>
          {mine
            ? "You made this proposal: a second person has to answer."
            : "Two browsers that opened the same link may belong to one person."}
        </p>
      )}
      {mayEdit && (
        <div className="wrap gap-6px">
          <Button
            size="compact-sm"
            loading={busy}
            disabled={mine}
            leftSection={<IconCheck size={14} aria-hidden />}
            onClick={() => say(true)}
          >
            Yes
            <span className="visually-hidden">
              {" "}
              to <bdi>{draft.name}</bdi>
            </span>
          </Button>
          <Button
            size="compact-sm"
            loading={busy}
            disabled={mine}
            leftSection={<IconX size={14} aria-hidden />}
            onClick={() => say(false)}
          >
            No
            <span className="visually-hidden">
              {" "}
              to <bdi>{draft.name}</bdi>
            </span>
          </Button>
          <Button size="compact-sm" variant="filled" onClick={onMerge}>
            Merge…<span className="visually-hidden"> {draft.name}</span>
          </Button>
        </div>
      )}
      {wrong !== "" && <p role="alert">{wrong}</p>}
    </div>
  );
}

async function deleteDraft({ id, name }: GraphDraft, client: QueryClient): Promise<void> {
  await deleteGraph(id);
  await refreshGraphs(client);
  notifications.show({
    title: `“${isolated(name)}” is deleted`,
    message: "You can restore it from the list of graphs.",
  });
}

function Row(props: DraftRowProps) {
  const { draft } = props;
  const { mayEdit } = useEditorContext();
  const client = useQueryClient();
  const { busy, wrong, step } = useDraftStep();
  return (
    <li className={style.row} data-state={draft.state}>
      <Link to={`/graphs/${draft.id}`}>
        <bdi>{draft.name}</bdi>
      </Link>
      <span className={style.quiet}>
        by <bdi>{authorName(draft.made_by)}</bdi>
        {" · "}
        {draft.state === "merged" ? "merged" : apartWords(draft)}
      </span>
      {mayEdit && (
        <ActionIcon
          className={style.remove ?? ""}
          aria-label={`Delete the draft ${isolated(draft.name)}`}
          loading={busy}
          onClick={() => void step(() => deleteDraft(draft, client))}
        >
          <IconTrash size={15} />
        </ActionIcon>
      )}
      <ProposalOf {...props} />
      {wrong !== "" && <p role="alert">{wrong}</p>}
    </li>
  );
}

/** Sort drafts: those that wait for an answer first, merged ones last. */
const rank = ({ state }: GraphDraft) => ({ proposed: 0, open: 1, merged: 2 })[state];

export function DraftsHere() {
  const { id, past, mayEdit } = useEditorContext();
  const found = useDrafts(id);
  const [making, setMaking] = useState(false);
  const [merging, setMerging] = useState<GraphDraft | null>(null);
  const drafts = [...(found.data ?? [])].sort((a, b) => rank(a) - rank(b));
  if (drafts.length === 0 && !mayEdit) return null;
  return (
    <section className={style.here} aria-label="Drafts">
      <ul>
        {drafts.map((draft) => (
          <Row key={draft.id} draft={draft} onMerge={() => setMerging(draft)} />
        ))}
      </ul>
      {mayEdit && (
        <Button
          fullWidth
          size="compact-sm"
          variant="light"
          leftSection={<IconGitBranch size={14} aria-hidden />}
          onClick={() => setMaking(true)}
        >
          {past === null ? "New draft…" : "New draft of this moment…"}
        </Button>
      )}
      <OverlayBoundary>
        {making && (
          <NewDraftDialog graph={id} seq={past?.at ?? null} onClose={() => setMaking(false)} />
        )}
        {merging && <MergeDialog draft={merging} into="origin" onClose={() => setMerging(null)} />}
      </OverlayBoundary>
    </section>
  );
}

interface NewDraftDialogProps {
  graph: string;
  /** The change of which it begins; null: as the graph is now. */
  seq: number | null;
  onClose: () => void;
}

export function NewDraftDialog({ graph, seq, onClose }: NewDraftDialogProps) {
  const [, go] = useLocation();
  const [name, setName] = useState("");
  const { busy, wrong, step } = useDraftStep();
  const make = () =>
    step(async () => {
      const made = await makeDraft(graph, { name, seq });
      onClose();
      go(`/graphs/${made.id}`);
    });
  return (
    <Modal opened onClose={onClose} title="New draft">
      <form
        onSubmit={(event) => {
          event.preventDefault();
          void make();
        }}
      >
        <TextInput
          label="What will it be about?"
          description={
            seq === null
              ? "A draft begins as the graph is now. What you do there changes nothing here until it is merged."
              : "A draft begins as the graph was at the moment on screen, and changes nothing here until it is merged."
          }
          placeholder="gentler grip"
          maxLength={200}
          data-autofocus
          value={name}
          error={wrong || undefined}
          onChange={(event) => setName(event.currentTarget.value)}
        />
        <div className={style.answers}>
          <Button onClick={onClose}>Cancel</Button>
          <Button type="submit" variant="filled" loading={busy}>
            Make it
          </Button>
        </div>
      </form>
    </Modal>
  );
}
