/** Links to one graph or run, without a name: made, copied, embedded and revoked. For owners. */
import { Button, Group, Select, Text, TextInput } from "@mantine/core";
import { IconCheck, IconCode, IconCopy } from "@tabler/icons-react";
import { type ReactNode, useState } from "react";
import { errorText } from "../api/http";
import { useMissingSites } from "../api/missing-sites";
import { useLive } from "../api/page-link";
import { siteOfId } from "../api/sites";
import {
  useFrameOrigins,
  useMakeViewLink,
  useRevokeViewLink,
  useViewLinks,
  type ViewedThing,
  type ViewLink,
} from "../api/view-links";
import { ConfirmRow } from "../ui/confirm-row";
import { copyText } from "../ui/copy-text";
import { ago, dateText, instant, useNow } from "../ui/times";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import style from "./share-dialog.module.css";

/** The choices of how long a link lasts, in days. */
const LASTS = [
  { value: "1", label: "1 day" },
  { value: "7", label: "7 days" },
  { value: "30", label: "30 days" },
  { value: "365", label: "1 year" },
];

/** Return the text that shows a link in a frame of another page. */
export function frameText(link: string, title: string): string {
  const written = title.replaceAll("&", "&amp;").replaceAll('"', "&quot;").replaceAll("<", "&lt;");
  return (
    `<iframe src="${link}" title="${written}" width="100%" height="480" ` +
    'sandbox="allow-scripts allow-same-origin" referrerpolicy="no-referrer" loading="lazy" ' +
    'style="border: 1px solid #ccc"></iframe>'
  );
}

function CopyButton({
  text,
  what,
  word = "Copy",
}: Record<"text" | "what", string> & { word?: string }) {
  const [state, setState] = useState<"idle" | "done" | "failed">("idle");
  const copy = async () => setState((await copyText(text)) ? "done" : "failed");
  const words = { idle: word, done: "Copied", failed: "Select and copy it by hand" }[state];
  const own = word === "Copy" ? <IconCopy size={15} /> : <IconCode size={15} />;
  return (
    <Button
      className={style.copy ?? ""}
      leftSection={state === "done" ? <IconCheck size={15} /> : own}
      aria-label={`${words}: ${what}`}
      onClick={() => void copy()}
    >
      {words}
    </Button>
  );
}

interface LinkToCopyProps {
  /** The person, thing or purpose that the link is for, as labels call it. */
  named: string;
  link: string;
  /** The sentence that says what a revocation does. */
  revoked: string;
  isRevoking: boolean;
  onRevoke: () => void;
  /** More buttons of the link. */
  children: ReactNode;
}

/** Shows a link with the buttons that copy it and, after a question, revoke it. */
export function LinkToCopy(props: LinkToCopyProps) {
  const { link, revoked, isRevoking, onRevoke, children } = props;
  const [asking, setAsking] = useState(false);
  const named = isolated(props.named);
  return (
    <>
      <div className={style.row}>
        <TextInput
          readOnly
          className={style.text ?? ""}
          aria-label={`Link for ${named}`}
          value={link}
          onFocus={(event) => event.currentTarget.select()}
        />
        <CopyButton text={link} what={`the link for ${named}`} />
        {children}
        <Button
          color="red"
          variant="subtle"
          className="ink-error"
          aria-label={`Revoke the link for ${named}`}
          onClick={() => setAsking(true)}
        >
          Revoke
        </Button>
      </div>
      {asking && (
        <ConfirmRow
          action="Revoke now"
          loading={isRevoking}
          onCancel={() => setAsking(false)}
          onConfirm={onRevoke}
        >
          {revoked}
        </ConfirmRow>
      )}
    </>
  );
}

interface Props {
  thing: ViewedThing;
  /** The address of the page in the links. */
  origin: string;
}

export function ViewLinks({ thing, origin }: Props) {
  const { runner } = useLive();
  const links = useViewLinks(runner, thing);
  const make = useMakeViewLink(runner, thing);
  const revoke = useRevokeViewLink(runner, thing);
  const frames = useFrameOrigins().data ?? [];
  const [label, setLabel] = useState("");
  const [days, setDays] = useState("7");
  const failed = [links, make, revoke].find(({ isError }) => isError)?.error;
  const open = links.data ?? [];
  const missing = useMissingSites("get /api/view-links");
  // The links of a run are at its site: only where that is not known all are asked.
  const unsaid = thing.kind === "run" && siteOfId(thing.id) === undefined ? missing : [];
  return (
    <>
      <form
        className="stack gap-50"
        aria-label={`New link to this ${thing.kind}`}
        onSubmit={(event) => {
          event.preventDefault();
          const more = { label: label.trim(), days: Number(days) };
          make.mutate(more, { onSuccess: () => setLabel("") });
        }}
      >
        <Text size="sm" c="dimmed">
          Everybody who has the link sees this {thing.kind} alone, without a name: no people, no
          other {thing.kind}s. They can change, start and stop nothing.
          {thing.kind === "graph" && " Comments are not shown."}
        </Text>
        <Group align="end" gap="sm">
          <TextInput
            flex="1 1 8rem"
            label="For what"
            placeholder="The wiki, a visitor …"
            maxLength={60}
            value={label}
            onChange={(event) => setLabel(event.currentTarget.value)}
          />
          <Select
            w={110}
            label="Lasts"
            data={LASTS}
            value={days}
            allowDeselect={false}
            onChange={(value) => setDays(value ?? "7")}
          />
          <Button type="submit" variant="filled" loading={make.isPending}>
            New link
          </Button>
        </Group>
      </form>
      {failed && (
        <p className="m-0 ink-error text-13" role="alert">
          {errorText(failed)}
        </p>
      )}
      {unsaid.map(({ url, words }) => (
        <p key={url} className="m-0 quiet-12" role="status">
          {words}: links to this run may be missing here.
        </p>
      ))}
      {open.length > 0 && (
        <section className={style.links} aria-label={`Links to this ${thing.kind}`}>
          <h3 className="m-0 text-13 weight-650">{counted(open.length, "link")}</h3>
          <ul>
            {open.map((link) => (
              <OneLink key={link.id} link={link} origin={origin} frames={frames} revoke={revoke} />
            ))}
          </ul>
        </section>
      )}
      {frames.length === 0 && (
        <Text size="sm" c="dimmed">
          No other site may show these links in a frame: name the sites in{" "}
          <code>ACTION_ASSISTANT_FRAME_ORIGINS</code>.
        </Text>
      )}
    </>
  );
}

interface LinkProps {
  link: ViewLink;
  origin: string;
  frames: readonly string[];
  /** The mutation of the dialog, which also shows its errors: a revoked link leaves the list. */
  revoke: ReturnType<typeof useRevokeViewLink>;
}

function OneLink({ link, origin, frames, revoke }: LinkProps) {
  const now = useNow(20_000);
  const text = origin + link.path;
  const named = link.label || `this ${link.kind}`;
  const opened = instant(link.opened_at);
  const end = instant(link.expires);
  return (
    <li className={style.link}>
      <div className={style.head}>
        {link.label !== "" && <b className="break-anywhere">{link.label}</b>}
        <span className="break-anywhere faint-12">
          {opened === null
            ? "Not opened yet"
            : `Opened ${counted(link.opened, "time")}, last ${ago(opened, now)}`}
          {end !== null && ` · ends ${dateText(end)}`} · by {isolated(link.made_by.name)}
        </span>
      </div>
      <LinkToCopy
        named={named}
        link={text}
        revoked="Whoever has it open sees nothing more, at once."
        isRevoking={revoke.isPending && revoke.variables === link.id}
        onRevoke={() => revoke.mutate(link.id)}
      >
        {frames.length > 0 && (
          <CopyButton
            text={frameText(text, link.label || `A ${link.kind}`)}
            what={`the frame for ${isolated(named)}`}
            word="Embed"
          />
        )}
      </LinkToCopy>
    </li>
  );
}
