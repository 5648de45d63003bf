/** Asks once more, in place, before something ends that cannot be brought back. */
import { Button } from "@mantine/core";
import style from "./confirm-row.module.css";

interface Props {
  /** Text that says what happens when the person goes on. */
  children: string;
  action: string;
  loading: boolean;
  onCancel: () => void;
  onConfirm: () => void;
}

export function ConfirmRow({ children, action, loading, onCancel, onConfirm }: Props) {
  return (
    <div className={style.row} role="alert">
      <span>{children}</span>
      <Button size="compact-sm" onClick={onCancel}>
        Keep
      </Button>
      <Button size="compact-sm" color="red" variant="filled" loading={loading} onClick={onConfirm}>
        {action}
      </Button>
    </div>
  );
}
