/** The comments in which others have mentioned the signed-in person. */
import { Button, Stack, Text } from "@mantine/core";
import { useState } from "react";
import { Link } from "wouter";
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

/** Shows the mentions; nothing while there are none. `onClose`: closes the menu around it. */
export function InboxList({ onClose }: { onClose: () => void }) {
  const { data } = useInbox();
  const read = useReadMentions();
  const [isAll, setAll] = useState(false);
  const mentions = data?.mentions ?? [];
  if (mentions.length === 0) return null;
  const unread = mentions.filter(({ is_read }) => !is_read);
  const shown = isAll ? mentions : unread.slice(0, SHOWN);
  return (
    <section aria-label="Mentions of you">
      <Text size="sm" mb={4}>
        {unread.length > 0 ? `Mentions of you: ${unread.length} unread` : "Mentions of you"}
      </Text>
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
              onClick={() => read.mutate(unread.map(({ key }) => key))}
            >
              Mark as read
            </Button>
          )}
        </div>
      </Stack>
    </section>
  );
}
