/** One thread: what was said, an answer, and whether it is done. */

import { Button } from "@mantine/core";
import { IconCheck, IconRotate2 } from "@tabler/icons-react";
import { useEffect, useRef, useState } from "react";
import { useSearch } from "wouter";
import { usePerson } from "../api/people";
import { serverNow } from "../clock/server-clock";
import { useEditorContext } from "../edit-actions/editor-context";
import { commentIn } from "../edit-actions/graph-links";
import { deleteMessage, reply, resolve, type Thread } from "../graph/edit/comments";
import { usePersonColors } from "../sync/use-room";
import { textScope, useWaitingTexts } from "../ui/kept-texts";
import { initials } from "../ui/name-colors";
import { ago, useNow } from "../ui/times";
import style from "./comments.module.css";
import { Write } from "./write";

interface SaidProps {
  thread: string;
  message: Thread["messages"][number];
  color: string;
}

/** One message: who, when, and what. */
function Said({ thread, message, color }: SaidProps) {
  const { doc, mayEdit } = useEditorContext();
  const { person } = usePerson();
  const now = useNow(30_000);
  return (
    <article className="flex gap-50">
      <span className={style.face} style={{ background: color }} aria-hidden>
        {initials(message.author.name || "Guest")}
      </span>
      <div className="fill">
        <p className="m-0 ink2 text-75">
          <b className="ink">{message.author.name || "Guest"}</b> {ago(message.at, now)}
          {message.author.id === person.id && mayEdit && (
            <button
              type="button"
              className={`${style.unsay} finger`}
              onClick={() => deleteMessage(doc, thread, message.id)}
            >
              Delete
            </button>
          )}
        </p>
        <p className={style.text}>{message.text}</p>
      </div>
    </article>
  );
}

interface ThreadCardProps {
  thread: Thread;
  /** Names what it is about; null where that is known. */
  place: string | null;
  /** Leads there; absent where it is in sight. */
  onPlace?: (() => void) | undefined;
}

export function ThreadCard({ thread, place, onPlace }: ThreadCardProps) {
  const { doc, id, mayEdit } = useEditorContext();
  const { person } = usePerson();
  const waits = useWaitingTexts(`${textScope(id, person.id)}comment/${thread.id}`) > 0;
  const colorOf = usePersonColors(thread.messages.map(({ author }) => author.id));
  const [answering, setAnswering] = useState(() => waits);
  const card = useRef<HTMLLIElement>(null);
  const isAsked = commentIn(useSearch()) === thread.id;
  useEffect(() => {
    if (isAsked) card.current?.focus();
  }, [isAsked]);
  const me = () => ({ author: { id: person.id, name: person.name }, at: serverNow() });
  return (
    <li
      ref={card}
      className={style.thread}
      data-thread={thread.id}
      tabIndex={-1}
      data-resolved={thread.resolved || undefined}
    >
      {place !== null &&
        (onPlace ? (
          <button type="button" className={style.place} onClick={onPlace}>
            {place}
          </button>
        ) : (
          <p className="m-0 break-anywhere ink2 weight-600">{place}</p>
        ))}
      {thread.messages.map((message) => (
        <Said
          key={message.id}
          thread={thread.id}
          message={message}
          color={colorOf(message.author.id)}
        />
      ))}
      {mayEdit &&
        (answering ? (
          <Write
            place={[id, thread.id]}
            label="Answer"
            button="Answer"
            autoFocus
            onCancel={() => setAnswering(false)}
            onSay={(text, mentions) => {
              reply(doc, thread.id, { ...me(), text, mentions });
              setAnswering(false);
            }}
          />
        ) : (
          <div className={`${style.buttons} fingers`}>
            <Button size="compact-sm" onClick={() => setAnswering(true)}>
              Answer
            </Button>
            <Button
              size="compact-sm"
              variant="subtle"
              leftSection={
                thread.resolved ? (
                  <IconRotate2 size={13} aria-hidden />
                ) : (
                  <IconCheck size={13} aria-hidden />
                )
              }
              onClick={() => resolve(doc, thread.id, !thread.resolved, me())}
            >
              {thread.resolved ? "Open again" : "Resolve"}
            </Button>
          </div>
        ))}
    </li>
  );
}
