/** One link: whom it lets in as what, its code, and its end. */
import { Button, TextInput } from "@mantine/core";
import { IconCheck, IconCopy, IconQrcode } from "@tabler/icons-react";
import { useState } from "react";
import { codeUrl, type Invitation, type useRevoke } from "../api/sharing";
import { copyText } from "../ui/copy-text";
import { ago, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./share-dialog.module.css";

const MOST_GUESTS = 6;

/** Who came in by a link, in a sentence. */
export function guestWords(guests: Invitation["guests"]): string {
  if (guests.length === 0) return "Nobody came in by it yet";
  const names = guests.slice(0, MOST_GUESTS).map(({ person }) => person.name || "Guest");
  const more = guests.length - names.length;
  return `${names.map(isolated).join(", ")}${more > 0 ? ` and ${more} more` : ""} came in`;
}

function Copy({ link, label }: { link: string; label: string }) {
  const [state, setState] = useState<"idle" | "done" | "failed">("idle");
  const copy = async () => setState((await copyText(link)) ? "done" : "failed");
  const words = { idle: "Copy", done: "Copied", failed: "Select and copy it by hand" }[state];
  return (
    <Button
      className={style.copy ?? ""}
      leftSection={state === "done" ? <IconCheck size={15} /> : <IconCopy size={15} />}
      aria-label={`${words}: the link for ${isolated(label)}`}
      onClick={() => void copy()}
    >
      {words}
    </Button>
  );
}

function Code({ src, label }: { src: string; label: string }) {
  return (
    <figure className={style.code}>
      <img src={src} alt={`QR code of the link for ${isolated(label)}`} width={232} height={232} />
      <figcaption>Point the camera of a phone or tablet at it.</figcaption>
    </figure>
  );
}

interface Props {
  invitation: Invitation;
  origin: string;
  /** Of the dialog, which also shows what went wrong: a link that was revoked is gone from here. */
  revoke: ReturnType<typeof useRevoke>;
}

export function ShareLink({ invitation, origin, revoke }: Props) {
  const now = useNow(20_000);
  const [code, setCode] = useState(false);
  const [asking, setAsking] = useState(false);
  const link = origin + invitation.path;
  const label = invitation.label || `${invitation.role}s`;
  const made = instant(invitation.made_at);
  return (
    <li className={style.link}>
      <div className={style.head}>
        <b className={style.role}>{invitation.role}</b>
        {invitation.label !== "" && <span className={style.label}>{invitation.label}</span>}
        <span className={style.facts}>
          {guestWords(invitation.guests)}
          {made !== null && ` · made ${ago(made, now)}`}
        </span>
      </div>
      <div className={style.row}>
        <TextInput
          readOnly
          className={style.text ?? ""}
          aria-label={`Link for ${isolated(label)}`}
          value={link}
          onFocus={(event) => event.currentTarget.select()}
        />
        <Copy link={link} label={label} />
        <Button
          leftSection={<IconQrcode size={15} />}
          aria-expanded={code}
          aria-label={`Code of the link for ${isolated(label)}`}
          onClick={() => setCode(!code)}
        >
          Code
        </Button>
        <Button
          color="red"
          variant="subtle"
          className={style.revoke ?? ""}
          aria-label={`Revoke the link for ${isolated(label)}`}
          onClick={() => setAsking(true)}
        >
          Revoke
        </Button>
      </div>
      {asking && (
        <div className={style.ask} role="alert">
          <span>Everybody who came in by it is put out at once, everywhere.</span>
          <Button size="compact-sm" onClick={() => setAsking(false)}>
            Keep
          </Button>
          <Button
            size="compact-sm"
            color="red"
            variant="filled"
            loading={revoke.isPending && revoke.variables === invitation.id}
            onClick={() => revoke.mutate(invitation.id)}
          >
            Revoke now
          </Button>
        </div>
      )}
      {code && <Code src={codeUrl(invitation.id, origin)} label={label} />}
    </li>
  );
}
