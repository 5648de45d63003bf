/** The history of a graph over its editor. */
import { Modal } from "@mantine/core";
import { HistoryList } from "./history-list";

interface Props {
  id: string;
  seq: number;
  mayEdit: boolean;
  onClose: () => void;
}

export function HistoryDialog({ onClose, ...props }: Props) {
  return (
    <Modal opened onClose={onClose} title="What was done to this graph" size="lg">
      <HistoryList {...props} />
    </Modal>
  );
}
