/** Question that opens when a person clicks a button that has to be held down. */
import { Button, Popover, Text } from "@mantine/core";
import type { ReactElement } from "react";

interface Props {
  opened: boolean;
  onChange: (opened: boolean) => void;
  name: string;
  question: string;
  onYes: () => void;
  children: ReactElement;
}

export function HoldQuestion({ opened, onChange, name, question, onYes, children }: Props) {
  return (
    <Popover opened={opened} onChange={onChange} position="bottom-end" withArrow trapFocus>
      <Popover.Target>{children}</Popover.Target>
      <Popover.Dropdown>
        <Text size="sm" mb="sm">
          {question}
        </Text>
        <Button variant="filled" fullWidth onClick={onYes}>
          {name}
        </Button>
        <Text size="xs" c="dimmed" mt="xs">
          Or hold the button for a moment.
        </Text>
      </Popover.Dropdown>
    </Popover>
  );
}
