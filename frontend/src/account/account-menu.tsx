/** The way to one's own name and appearance. */
import { Avatar, Popover, Text, UnstyledButton } from "@mantine/core";
import { useState } from "react";
import { useKnownColors } from "../api/people";
import { usePerson } from "../api/use-person";
import { initials } from "../ui/name-colors";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";

const AccountPanel = lazyPart(() => import("./account-panel").then((part) => part.AccountPanel));

/** `onShare` for who may: the bar of a narrow screen has no room for a button of its own. */
export function AccountMenu({ onShare }: { onShare: (() => void) | null }) {
  const { person } = usePerson();
  const colorOf = useKnownColors([person.id]);
  const [open, setOpen] = useState(false);
  return (
    <Popover opened={open} onChange={setOpen} position="bottom-end" withArrow width={264}>
      <Popover.Target>
        <UnstyledButton
          onClick={() => setOpen((was) => !was)}
          aria-label={`You are ${person.name || "Guest"}. Name and appearance`}
          title={person.name || "Guest"}
        >
          <Avatar size={28} radius="xl" variant="filled" color={colorOf(person.id)}>
            <Text span size="xs" fw={650} c="#fff" aria-hidden>
              {initials(person.name || "Guest")}
            </Text>
          </Avatar>
        </UnstyledButton>
      </Popover.Target>
      <Popover.Dropdown>
        <PartBoundary>
          <AccountPanel onShare={onShare} onClose={() => setOpen(false)} />
        </PartBoundary>
      </Popover.Dropdown>
    </Popover>
  );
}
