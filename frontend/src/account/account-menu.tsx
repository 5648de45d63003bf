/** The way to one's own name and appearance. */
import { UnstyledButton } from "@mantine/core";
import type { ComponentProps } from "react";
import { useInbox } from "../api/mentions";
import { useKnownColors, usePerson } from "../api/people";
import { LateOpening } from "../ui/late-opening";
import { lazyPart } from "../ui/lazy-part";
import { initials } from "../ui/name-colors";
import style from "./account-menu.module.css";

const AccountPopover = lazyPart(() =>
  import("./account-panel").then((part) => part.AccountPopover),
);

type Props = Pick<ComponentProps<typeof AccountPopover>, "onShare" | "onLeave">;

export function AccountMenu({ onShare, onLeave }: Props) {
  const { person } = usePerson();
  const colorOf = useKnownColors([person.id]);
  const unread = useInbox().data?.unread ?? 0;
  return (
    <LateOpening
      opens="dialog"
      part={(button) => <AccountPopover button={button} onShare={onShare} onLeave={onLeave} />}
    >
      <UnstyledButton title={person.name || "Guest"} className={style.button ?? ""}>
        <span className="visually-hidden">
          You are <bdi>{person.name || "Guest"}</bdi>. Name and appearance
          {unread > 0 && `. ${unread} unread ${unread === 1 ? "mention" : "mentions"}`}
        </span>
        <span className={style.face} style={{ background: colorOf(person.id) }} aria-hidden>
          {initials(person.name || "Guest")}
        </span>
        {unread > 0 && (
          <span className={style.unread} aria-hidden>
            {unread > 9 ? "9+" : unread}
          </span>
        )}
      </UnstyledButton>
    </LateOpening>
  );
}
