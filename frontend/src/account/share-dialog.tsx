/** Share: links with a role, who came in by them, and their end. For owners. */
import { Button, Group, Modal, Select, Text, TextInput } from "@mantine/core";
import { IconLock, IconLockOpen2, IconPlugConnectedX, IconQrcode } from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { pageUrl } from "../api/page-url";
import { ROLE_WORDS, type Role } from "../api/session";
import {
  codeUrl,
  type Invitation,
  type Sharing,
  useInvite,
  useRevoke,
  useSharing,
} from "../api/sharing";
import type { ViewedThing } from "../api/view-links";
import { useIsPhone } from "../ui/hooks";
import { Segments } from "../ui/segments";
import { ago, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./share-dialog.module.css";
import { LinkToCopy, ViewLinks } from "./view-links";

const INVITED = ["viewer", "editor", "operator"] as const satisfies readonly Role[];
const LABELS: Record<(typeof INVITED)[number], string> = {
  viewer: "Viewer",
  editor: "Editor",
  operator: "Operator",
};

/** The page's own place first, if others can reach it by that. */
export function originsOf(sharing: Sharing, own: { page: string; hostname: string }): string[] {
  const here = /^(localhost|127\.0\.0\.1|\[::1\])$/.test(own.hostname) ? [] : [own.page];
  return [...new Set([...here, ...sharing.origins])];
}

function Where({ secure, proxied, reached }: Record<"secure" | "proxied" | "reached", boolean>) {
  if (!reached) {
    return (
      <p className={style.where} data-tone="off">
        <IconPlugConnectedX size={18} aria-hidden />
        <span>
          <b className="ink">Only this computer reaches this server.</b> Restart the server with{" "}
          <code>action-assistant serve --share</code>. Links that you make now work after that.
        </span>
      </p>
    );
  }
  return secure ? (
    <p className={style.where}>
      <IconLock size={18} aria-hidden />
      <span>
        <b className="ink">Encrypted.</b>{" "}
        {proxied ? (
          "The proxy in front of this server has the certificate."
        ) : (
          <>
            Browsers of others show a warning until they trust this server’s certificate authority,
            the file <code>tls/ca.pem</code> in its data folder.
          </>
        )}
      </span>
    </p>
  ) : (
    <p className={style.where} data-tone="off">
      <IconLockOpen2 size={18} aria-hidden />
      <span>
        <b className="ink">Not encrypted.</b> Others on the same network can read what is sent,
        links too.{" "}
        {proxied ? (
          "Give the proxy a certificate"
        ) : (
          <>
            Start the server with <code>--tls</code>
          </>
        )}{" "}
        where you do not trust everybody there.
      </span>
    </p>
  );
}

function NewLink() {
  const invite = useInvite();
  const [role, setRole] = useState<(typeof INVITED)[number]>("editor");
  const [label, setLabel] = useState("");
  return (
    <form
      className="stack gap-50"
      aria-label="New link"
      onSubmit={(event) => {
        event.preventDefault();
        invite.mutate({ role, label: label.trim() }, { onSuccess: () => setLabel("") });
      }}
    >
      <Segments
        fullWidth
        label="Role"
        data={INVITED.map((value) => ({ value, label: LABELS[value] }))}
        value={role}
        onChange={setRole}
      />
      <Text size="sm" c="dimmed">
        Everybody who has the link may {ROLE_WORDS[role]}. A link for one person is made on{" "}
        <Link to="/people">People and devices</Link>.
      </Text>
      <Group wrap="nowrap" align="end" gap="sm">
        <TextInput
          flex={1}
          label="For whom"
          placeholder="A person, a tablet, a class …"
          maxLength={60}
          value={label}
          error={invite.isError ? errorText(invite.error) : undefined}
          onChange={(event) => setLabel(event.currentTarget.value)}
        />
        <Button type="submit" variant="filled" loading={invite.isPending}>
          New link
        </Button>
      </Group>
    </form>
  );
}

/** Kinds of links: with a role and a name, or to one thing without a name. */
type Kind = "role" | "thing";

function Body({ thing }: { thing: ViewedThing | null }) {
  const sharing = useSharing();
  const [kind, setKind] = useState<Kind>("role");
  const [chosen, setChosen] = useState<string | null>(null);
  if (sharing.isError) return <Text>{errorText(sharing.error)}</Text>;
  if (!sharing.data) return <div className={style.waiting} aria-busy="true" />;
  const origins = originsOf(sharing.data, { page: pageUrl(), hostname: location.hostname });
  const origin = origins.find((each) => each === chosen) ?? origins[0] ?? pageUrl();
  return (
    <div className={style.body}>
      <Where
        secure={sharing.data.secure}
        proxied={sharing.data.proxied === true}
        reached={origins.length > 0}
      />
      {thing !== null && (
        <Segments
          fullWidth
          label="Kind of link"
          data={[
            { value: "role", label: "To work here" },
            { value: "thing", label: `To look at this ${thing.kind} only` },
          ]}
          value={kind}
          onChange={setKind}
        />
      )}
      {thing !== null && kind === "thing" ? (
        <ViewLinks thing={thing} origin={origin} />
      ) : (
        <RoleLinks
          origins={origins}
          origin={origin}
          onOrigin={setChosen}
          invitations={sharing.data.invitations}
        />
      )}
    </div>
  );
}

interface RoleLinksProps {
  origins: readonly string[];
  origin: string;
  onOrigin: (origin: string | null) => void;
  invitations: Sharing["invitations"];
}

function RoleLinks({ origins, origin, onOrigin, invitations }: RoleLinksProps) {
  const revoke = useRevoke(useLive().runner);
  const open = invitations.filter((each) => each.path !== undefined);
  const over = invitations.filter((each) => each.path === undefined);
  return (
    <>
      <NewLink />
      {open.length > 0 && (
        <section className={style.links} aria-label="Links">
          <div className={style.heading}>
            <h3 className="m-0 text-13 weight-650">{counted(open.length, "link")}</h3>
            {origins.length > 1 && (
              <Select
                aria-label="Address in the links"
                size="xs"
                data={origins}
                value={origin}
                onChange={onOrigin}
              />
            )}
          </div>
          <ul>
            {open.map((invitation) => (
              <ShareLink
                key={invitation.id}
                invitation={invitation}
                origin={origin}
                revoke={revoke}
              />
            ))}
          </ul>
        </section>
      )}
      {revoke.isError && (
        <p className="m-0 ink-error text-13" role="alert">
          {errorText(revoke.error)}{" "}
          <Button
            size="compact-sm"
            loading={revoke.isPending}
            onClick={() => revoke.mutate(revoke.variables)}
          >
            Try again
          </Button>
        </p>
      )}
      {over.length > 0 && (
        <Text size="sm" c="dimmed">
          Revoked: {over.map((each) => each.label || `a link for ${each.role}s`).join(", ")}
        </Text>
      )}
    </>
  );
}

interface Props {
  opened: boolean;
  onClose: () => void;
  /** The graph or run on screen, to which links without a name can be made. */
  thing: ViewedThing | null;
}

export function ShareDialog({ opened, onClose, thing }: Props) {
  const phone = useIsPhone();
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title="Share"
      size={620}
      fullScreen={phone}
      centered
      closeButtonProps={{ "aria-label": "Close" }}
    >
      <Body thing={thing} />
    </Modal>
  );
}

const MOST_GUESTS = 6;

/** Return one sentence about the people who came in by a link. */
export function guestWords(guests: Invitation["guests"]): string {
  if (guests.length === 0) return "Not used yet";
  const names = guests.slice(0, MOST_GUESTS).map(({ person }) => person.name || "Guest");
  const more = guests.length - names.length;
  return `${names.map(isolated).join(", ")}${more > 0 ? ` and ${more} more` : ""} came in`;
}

function Code({ src, label }: { src: string; label: string }) {
  return (
    <figure className={style.code}>
      <img src={src} alt={`QR code of the link for ${isolated(label)}`} width={232} height={232} />
      <figcaption>Point the camera of a phone or tablet at it.</figcaption>
    </figure>
  );
}

interface ShareLinkProps {
  invitation: Invitation;
  origin: string;
  /** The mutation of the dialog, which also shows its errors: a revoked link leaves the list. */
  revoke: ReturnType<typeof useRevoke>;
}

export function ShareLink({ invitation, origin, revoke }: ShareLinkProps) {
  const now = useNow(20_000);
  const [code, setCode] = useState(false);
  const link = origin + invitation.path;
  const label = invitation.label || `${invitation.role}s`;
  const made = instant(invitation.made_at);
  return (
    <li className={style.link}>
      <div className={style.head}>
        <b className={style.role}>{invitation.role}</b>
        {invitation.label !== "" && <span className="break-anywhere">{invitation.label}</span>}
        <span className="break-anywhere faint-12">
          {guestWords(invitation.guests)}
          {made !== null && ` · made ${ago(made, now)}`}
        </span>
      </div>
      <LinkToCopy
        named={label}
        link={link}
        revoked="Everybody who signed in with this link is signed out at once, on all devices."
        isRevoking={revoke.isPending && revoke.variables === invitation.id}
        onRevoke={() => revoke.mutate(invitation.id)}
      >
        <Button
          leftSection={<IconQrcode size={15} />}
          aria-expanded={code}
          aria-label={`Code of the link for ${isolated(label)}`}
          onClick={() => setCode(!code)}
        >
          Code
        </Button>
      </LinkToCopy>
      {code && <Code src={codeUrl(invitation.id, origin)} label={label} />}
    </li>
  );
}
