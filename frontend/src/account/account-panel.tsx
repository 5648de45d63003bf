/** One's own name, light or dark, and the way out. */
import {
  Button,
  Group,
  Popover,
  Stack,
  Text,
  TextInput,
  useMantineColorScheme,
} from "@mantine/core";
import {
  IconDeviceDesktop,
  IconDevices,
  IconFileSearch,
  IconHelp,
  IconLogout,
  IconMoon,
  type IconProps,
  IconServerCog,
  IconShare,
  IconSun,
  IconTerminal2,
} from "@tabler/icons-react";
import {
  type ButtonHTMLAttributes,
  type ComponentType,
  cloneElement,
  type ReactElement,
  useState,
} from "react";
import { Link } from "wouter";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { helpUrl } from "../api/page-url";
import { useMay, usePerson } from "../api/people";
import { ROLE_WORDS, rememberedName, signOut } from "../api/session";
import { useOpening } from "../ui/late-opening";
import { Segments } from "../ui/segments";
import style from "./account-panel.module.css";
import { InboxList } from "./inbox";
import { NotificationSwitch } from "./notifier";

const schemes = [
  { value: "light", label: <IconSun size={15} aria-label="Light" /> },
  { value: "dark", label: <IconMoon size={15} aria-label="Dark" /> },
  { value: "auto", label: <IconDeviceDesktop size={15} aria-label="Like the system" /> },
] as const;

function Appearance() {
  const { colorScheme, setColorScheme } = useMantineColorScheme();
  return (
    <div>
      <Text size="sm" mb={4}>
        Appearance
      </Text>
      <Segments fullWidth size="xs" data={schemes} value={colorScheme} onChange={setColorScheme} />
    </div>
  );
}

interface WayProps {
  to: string;
  Sign: ComponentType<IconProps>;
  onClose: () => void;
  children: string;
}

/** A button that leads to a page of its own. */
function Way({ to, Sign, onClose, children }: WayProps) {
  return (
    <Button
      component={Link}
      to={to}
      variant="default"
      leftSection={<Sign size={15} aria-hidden />}
      onClick={onClose}
    >
      {children}
    </Button>
  );
}

interface Props {
  /** Opens *Share*; null for those who may not. The bar of a narrow screen has no room for a button of its own. */
  onShare: (() => void) | null;
  onClose: () => void;
  /** Called before the page goes; removes from the device what is to leave it with this person. */
  onLeave: (person: string) => Promise<void>;
}

const UNPROVEN =
  "A Stop is not proven. Once you sign out, this page sends it no more, and does not show what becomes of it. Press Sign out again to leave all the same.";

export function AccountPanel({ onShare, onClose, onLeave }: Props) {
  const { person, rename } = usePerson();
  const { live, runner } = useLive();
  const mayLook = useMay("restore");
  const mayShare = useMay("share");
  const [name, setName] = useState(rememberedName() || person.name);
  const [problem, setProblem] = useState("");
  const [obstacle, setObstacle] = useState("");
  const [hasWarned, setHasWarned] = useState(false);
  const save = async () => {
    try {
      await rename(name.trim());
      onClose();
    } catch (error) {
      setProblem(errorText(error));
    }
  };
  const leave = async () => {
    if (live?.isStopping && !hasWarned) {
      setHasWarned(true);
      setObstacle(UNPROVEN);
      return;
    }
    try {
      await signOut(runner);
      await onLeave(person.id);
      location.reload();
    } catch (error) {
      setObstacle(errorText(error));
    }
  };
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        void save();
      }}
    >
      <Stack gap="sm">
        {person.personal ? (
          <Text>
            <b>
              <bdi>{person.name}</bdi>
            </b>
          </Text>
        ) : (
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
        )}
        {person.role !== "owner" && (
          <Text size="sm" c="dimmed">
            You are here as {person.role}: you may {ROLE_WORDS[person.role]}.
          </Text>
        )}
        <InboxList onClose={onClose} />
        {onShare !== null && (
          <Button
            leftSection={<IconShare size={15} aria-hidden />}
            onClick={() => {
              onClose();
              onShare();
            }}
          >
            Share with others …
          </Button>
        )}
        <Way to="/programs" Sign={IconTerminal2} onClose={onClose}>
          Programs
        </Way>
        <Way to="/people" Sign={IconDevices} onClose={onClose}>
          {mayShare ? "People and devices" : "Your devices"}
        </Way>
        {mayLook && (
          <Way to="/admin" Sign={IconServerCog} onClose={onClose}>
            Administration
          </Way>
        )}
        {mayLook && (
          <Way to="/audit" Sign={IconFileSearch} onClose={onClose}>
            Audit
          </Way>
        )}
        {!window.isSecureContext && (
          <Text size="sm" c="dimmed">
            This page was loaded without TLS. Pasting with a button, and opening the page while the
            server is off, need <code>--tls</code>.
          </Text>
        )}
        <Appearance />
        <NotificationSwitch />
        <Button
          component="a"
          href={helpUrl("")}
          target="_blank"
          rel="noopener"
          variant="default"
          leftSection={<IconHelp size={15} aria-hidden />}
        >
          Help
        </Button>
        {obstacle !== "" && (
          <p className="m-0 ink-error text-13" role="alert">
            {obstacle}
          </p>
        )}
        <Button
          variant="default"
          leftSection={<IconLogout size={15} aria-hidden />}
          onClick={() => void leave()}
        >
          Sign out
        </Button>
      </Stack>
    </form>
  );
}

interface AccountPopoverProps extends Omit<Parameters<typeof AccountPanel>[0], "onClose"> {
  button: ReactElement<ButtonHTMLAttributes<HTMLButtonElement>>;
}

export function AccountPopover({ button, onShare, onLeave }: AccountPopoverProps) {
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
      <Popover.Dropdown className={style.panel ?? ""}>
        <AccountPanel onShare={onShare} onLeave={onLeave} onClose={() => setOpen(false)} />
      </Popover.Dropdown>
    </Popover>
  );
}
