/** The comments in which others have mentioned the signed-in person. */
import { Button, Stack, Text } from "@mantine/core";
import { useRef, useState } from "react";
import { Link } from "wouter";
import { errorText } from "../api/http";
import { type Mention, mentionPath, useInbox, useReadMentions } from "../api/mentions";
import { serverNow } from "../clock/server-clock";
import { ago, instant } from "../ui/times";
import style from "./inbox.module.css";

const SHOWN = 6;

interface RowProps {
  mention: Mention;
  onGo: () => void;
}

function Row({ mention, onGo }: RowProps) {
  const { author, graph_name, text, at, is_read } = mention;
  return (
    <li>
      <Link
        to={mentionPath(mention)}
        className={style.row ?? ""}
        data-unread={!is_read || undefined}
        onClick={onGo}
      >
        <span className="text-75 ink2">
          <b className="ink">
            <bdi>{author.name || "Somebody"}</bdi>
          </b>{" "}
          in <bdi>{graph_name}</bdi>, {ago(instant(at) ?? 0, serverNow())}
        </span>
        <span className={style.text}>
          <bdi>{text}</bdi>
        </span>
      </Link>
    </li>
  );
}

interface FailureProps {
  what: string;
  error: unknown;
  isBusy: boolean;
  onAgain: () => void;
}

function Failure({ what, error, isBusy, onAgain }: FailureProps) {
  return (
    <div>
      <Text size="sm" className="ink-error" role="alert">
        {what} {errorText(error)}
      </Text>
      <Button size="compact-sm" variant="subtle" loading={isBusy} onClick={onAgain}>
        Try again
      </Button>
    </div>
  );
}

/** Shows the mentions; nothing while there are none. `onClose`: closes the menu around it. */
export function InboxList({ onClose }: { onClose: () => void }) {
  const { data, error, isFetching, refetch } = useInbox();
  const read = useReadMentions();
  const [isAll, setAll] = useState(false);
  const heading = useRef<HTMLParagraphElement>(null);
  const mentions = data?.mentions ?? [];
  if (mentions.length === 0 && error === null) return null;
  const unread = mentions.filter(({ is_read }) => !is_read);
  const shown = isAll ? mentions : unread.slice(0, SHOWN);
  const count = data?.unread ?? 0;
  return (
    <section aria-label="Mentions of you">
      <Text ref={heading} size="sm" mb={4} tabIndex={-1} role="status">
        {count > 0 ? `Mentions of you: ${count} unread` : "Mentions of you"}
      </Text>
      {error !== null && (
        <Failure
          what="Your mentions cannot be read."
          error={error}
          isBusy={isFetching}
          onAgain={() => void refetch()}
        />
      )}
      {read.isError && (
        <Failure
          what="They are not marked as read."
          error={read.error}
          isBusy={read.isPending}
          onAgain={() => read.mutate(read.variables)}
        />
      )}
      <Stack gap={6}>
        {shown.length > 0 && (
          <ul className={style.list}>
            {shown.map((mention) => (
              <Row
                key={mention.key}
                mention={mention}
                onGo={() => {
                  if (!mention.is_read) read.mutate([mention.key]);
                  onClose();
                }}
              />
            ))}
          </ul>
        )}
        <div className="flex gap-50">
          {!isAll && mentions.length > shown.length && (
            <Button size="compact-sm" variant="subtle" onClick={() => setAll(true)}>
              Show all {mentions.length}
            </Button>
          )}
          {unread.length > 0 && (
            <Button
              size="compact-sm"
              variant="subtle"
              onClick={() => {
                heading.current?.focus(); // the button goes
                read.mutate(unread.map(({ key }) => key));
              }}
            >
              Mark as read
            </Button>
          )}
        </div>
      </Stack>
    </section>
  );
}
