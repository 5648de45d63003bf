/** Asks for what to say with a proposal. */
import { Button, Modal, Textarea } from "@mantine/core";
import { type GraphDraft, proposeDraft } from "../api/documents/drafts";
import { usePerson } from "../api/use-person";
import { textScope, useKeptText } from "../ui/drafts/kept-texts";
import style from "./drafts.module.css";
import { useDraftStep } from "./use-draft-step";

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
        description="Others see it in the history of the graph, look at the draft, and say yes or no."
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
