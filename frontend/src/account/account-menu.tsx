/** The way to one's own name and appearance. */
import { UnstyledButton } from "@mantine/core";
import type { ComponentProps } from "react";
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
  return (
    <LateOpening
      opens="dialog"
      part={(button) => <AccountPopover button={button} onShare={onShare} onLeave={onLeave} />}
    >
      <UnstyledButton title={person.name || "Guest"}>
        <span className="visually-hidden">
          You are <bdi>{person.name || "Guest"}</bdi>. Name and appearance
        </span>
        <span className={style.face} style={{ background: colorOf(person.id) }} aria-hidden>
          {initials(person.name || "Guest")}
        </span>
      </UnstyledButton>
    </LateOpening>
  );
}
