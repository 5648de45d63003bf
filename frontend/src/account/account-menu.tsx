/** The way to one's own name and appearance. */
import { Avatar, Popover, Text, UnstyledButton } from "@mantine/core";
import { type ComponentProps, useState } from "react";
import { useKnownColors } from "../api/people";

import { usePerson } from "../api/use-person";
import { initials } from "../ui/name-colors";
import { lazyPart } from "../ui/parts/lazy-part";
import { PartBoundary } from "../ui/parts/part-boundary";

const AccountPanel = lazyPart(() => import("./account-panel").then((part) => part.AccountPanel));

type Props = Pick<ComponentProps<typeof AccountPanel>, "onShare" | "onLeave">;

export function AccountMenu({ onShare, onLeave }: Props) {
  const { person } = usePerson();
  const colorOf = useKnownColors([person.id]);
  const [open, setOpen] = useState(false);
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
      <Popover.Target>
        <UnstyledButton onClick={() => setOpen((was) => !was)} title={person.name || "Guest"}>
          <span className="visually-hidden">
            You are <bdi>{person.name || "Guest"}</bdi>. Name and appearance
          </span>
          <Avatar size={28} radius="xl" variant="filled" color={colorOf(person.id)}>
            <Text span size="xs" fw={650} c="#fff" aria-hidden>
              {initials(person.name || "Guest")}
            </Text>
          </Avatar>
        </UnstyledButton>
      </Popover.Target>
      <Popover.Dropdown>
        <PartBoundary>
          <AccountPanel onShare={onShare} onLeave={onLeave} onClose={() => setOpen(false)} />
        </PartBoundary>
      </Popover.Dropdown>
    </Popover>
  );
}
