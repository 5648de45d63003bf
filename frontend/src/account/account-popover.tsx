/** One's own name and appearance, opened at the button that leads there. */
import { Popover } from "@mantine/core";
import { type ButtonHTMLAttributes, cloneElement, type ReactElement } from "react";
import { useOpening } from "../ui/floating/late-opening";
import { AccountPanel } from "./account-panel";

interface Props extends Omit<Parameters<typeof AccountPanel>[0], "onClose"> {
  button: ReactElement<ButtonHTMLAttributes<HTMLButtonElement>>;
}

export function AccountPopover({ button, onShare, onLeave }: Props) {
  const [open, setOpen] = useOpening();
  return (
    <Popover
      opened={open}
      onChange={setOpen}
      position="bottom-end"
      withArrow
      trapFocus
      returnFocus
      width={264}
    >
      <Popover.Target>{cloneElement(button, { onClick: () => setOpen(!open) })}</Popover.Target>
      <Popover.Dropdown>
        <AccountPanel onShare={onShare} onLeave={onLeave} onClose={() => setOpen(false)} />
      </Popover.Dropdown>
    </Popover>
  );
}
