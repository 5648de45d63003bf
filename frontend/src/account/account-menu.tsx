/** One's own name, and light or dark. */
import {
  Avatar,
  Button,
  Group,
  Popover,
  SegmentedControl,
  Stack,
  Text,
  TextInput,
  UnstyledButton,
  useMantineColorScheme,
} from "@mantine/core";
import { IconDeviceDesktop, IconLogout, IconMoon, IconShare, IconSun } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import { useLive } from "../api/live/use-live";
import { useKnownColors } from "../api/people";
import { ROLE_WORDS, rememberedName, signOut } from "../api/session";
import { usePerson } from "../api/use-person";
import { initials } from "../ui/name-colors";

const schemes = [
  { value: "light", label: <IconSun size={15} aria-label="Light" /> },
  { value: "dark", label: <IconMoon size={15} aria-label="Dark" /> },
  { value: "auto", label: <IconDeviceDesktop size={15} aria-label="Like the system" /> },
];

function Appearance() {
  const { colorScheme, setColorScheme } = useMantineColorScheme();
  return (
    <div>
      <Text size="sm" mb={4}>
        Appearance
      </Text>
      <SegmentedControl
        fullWidth
        size="xs"
        data={schemes}
        value={colorScheme}
        onChange={(value) => setColorScheme(value as "light" | "dark" | "auto")}
      />
    </div>
  );
}

/** `onShare` for who may: the bar of a narrow screen has no room for a button of its own. */
export function AccountMenu({ onShare }: { onShare: (() => void) | null }) {
  const { person, rename } = usePerson();
  const { runner } = useLive();
  const colorOf = useKnownColors([person.id]);
  const [open, setOpen] = useState(false);
  const [name, setName] = useState(rememberedName() || person.name);
  const [problem, setProblem] = useState("");
  const save = async () => {
    try {
      await rename(name.trim());
      setOpen(false);
    } catch (error) {
      setProblem(errorText(error));
    }
  };
  const leave = async () => {
    try {
      await signOut(runner);
      location.reload();
    } catch (error) {
      setProblem(errorText(error));
    }
  };
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
        <form
          onSubmit={(event) => {
            event.preventDefault();
            void save();
          }}
        >
          <Stack gap="sm">
            <Group gap="sm" align="end" wrap="nowrap">
              <TextInput
                label="Your name"
                value={name}
                maxLength={60}
                error={problem || undefined}
                onChange={(event) => setName(event.currentTarget.value)}
                data-autofocus
                flex={1}
              />
              <Button type="submit" disabled={name.trim() === "" || name === person.name}>
                Save
              </Button>
            </Group>
            {person.role !== "owner" && (
              <Text size="sm" c="dimmed">
                You are here as {person.role}: you may {ROLE_WORDS[person.role]}.
              </Text>
            )}
            {onShare !== null && (
              <Button
                leftSection={<IconShare size={15} aria-hidden />}
                onClick={() => {
                  setOpen(false);
                  onShare();
                }}
              >
                Share with others …
              </Button>
            )}
            {!window.isSecureContext && (
              <Text size="sm" c="dimmed">
                This page came without TLS: reading the clipboard by a button, and opening without a
                server, need <code>--tls</code>.
              </Text>
            )}
            <Appearance />
            <Button
              variant="default"
              leftSection={<IconLogout size={15} aria-hidden />}
              onClick={() => void leave()}
            >
              Sign out
            </Button>
          </Stack>
        </form>
      </Popover.Dropdown>
    </Popover>
  );
}
