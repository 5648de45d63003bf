/** What people say about an action, or about any: threads with answers, done or open. */
import { Button, Textarea } from "@mantine/core";
import { IconCheck, IconMessageCircle, IconRotate2 } from "@tabler/icons-react";
import { useState } from "react";
import { usePerson } from "../api/use-person";
import { printedKeys } from "../edit-actions/edit-action";
import { selectedActions, useEditorContext } from "../edit-actions/editor-context";
import { beginThread, deleteMessage, reply, resolve, type Thread } from "../graph/edit/comments";
import type { Key } from "../graph/model";
import { endName } from "../graph/relation-words";
import { usePersonColors } from "../sync/use-room";
import { Empty } from "../ui/empty";
import { Tooltip } from "../ui/floating/tooltip";
import { initials } from "../ui/name-colors";
import { ago, useNow } from "../ui/times";
import style from "./comments.module.css";

interface WriteProps {
  label: string;
  button: string;
  onSay: (text: string) => void;
  autoFocus?: boolean;
  onCancel?: () => void;
}

function Write({ label, button, onSay, autoFocus = false, onCancel }: WriteProps) {
  const [text, setText] = useState("");
  const say = () => {
    if (text.trim() === "") return;
    onSay(text.trim());
    setText("");
  };
  return (
    <form
      className={style.write}
      onSubmit={(event) => {
        event.preventDefault();
        say();
      }}
    >
      <Textarea
        aria-label={label}
        placeholder={`${label} …`}
        autosize
        minRows={1}
        maxRows={8}
        maxLength={10_000}
        autoFocus={autoFocus}
        value={text}
        onChange={(event) => setText(event.currentTarget.value)}
        onKeyDown={(event) => {
          if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) say();
          if (event.key === "Escape") onCancel?.();
        }}
      />
      {(text !== "" || onCancel) && (
        <div className={style.buttons}>
          <Button
            type="submit"
            size="compact-sm"
            variant="filled"
            disabled={text.trim() === ""}
            title={printedKeys("Mod+Enter").join(" ")}
          >
            {button}
          </Button>
          {onCancel && (
            <Button size="compact-sm" variant="subtle" onClick={onCancel}>
              Cancel
            </Button>
          )}
        </div>
      )}
    </form>
  );
}

interface ThreadCardProps {
  thread: Thread;
  /** Names the action; absent where that is known. */
  place: string | null;
  onPlace: () => void;
}

function ThreadCard({ thread, place, onPlace }: ThreadCardProps) {
  const { doc, mayEdit } = useEditorContext();
  const { person } = usePerson();
  const colorOf = usePersonColors(thread.messages.map(({ author }) => author.id));
  const now = useNow(30_000);
  const [answering, setAnswering] = useState(false);
  const me = () => ({ author: { id: person.id, name: person.name }, at: Date.now() });
  return (
    <li className={style.thread} data-resolved={thread.resolved || undefined}>
      {place !== null && (
        <button type="button" className={style.place} onClick={onPlace}>
          {place}
        </button>
      )}
      {thread.messages.map((message) => (
        <article className={style.message} key={message.id}>
          <span
            className={style.face}
            style={{ background: colorOf(message.author.id) }}
            aria-hidden
          >
            {initials(message.author.name || "Guest")}
          </span>
          <div className={style.body}>
            <p className={style.who}>
              <b>{message.author.name || "Guest"}</b> {ago(message.at, now)}
              {message.author.id === person.id && mayEdit && (
                <button
                  type="button"
                  className={style.unsay}
                  onClick={() => deleteMessage(doc, thread.id, message.id)}
                >
                  Delete
                </button>
              )}
            </p>
            <p className={style.text}>{message.text}</p>
          </div>
        </article>
      ))}
      {mayEdit &&
        (answering ? (
          <Write
            label="Answer"
            button="Answer"
            autoFocus
            onCancel={() => setAnswering(false)}
            onSay={(text) => {
              reply(doc, thread.id, { ...me(), text });
              setAnswering(false);
            }}
          />
        ) : (
          <div className={style.buttons}>
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

export function Comments({ threads }: { threads: readonly Thread[] }) {
  const context = useEditorContext();
  const { person } = usePerson();
  const [done, setDone] = useState(false);
  const [action = null] = selectedActions(context);
  const here = threads.filter((thread) => action === null || thread.about === action.key);
  const open = here.filter((thread) => !thread.resolved);
  const resolved = here.length - open.length;
  const go = (about: Key) => {
    context.select([about]);
    context.view.show([about]);
  };
  return (
    <div className={style.comments}>
      {action !== null && context.mayEdit && (
        <Write
          key={action.key}
          label={`Comment on ${endName(context.graph, action.key)}`}
          button="Comment"
          onSay={(text) =>
            beginThread(context.doc, action.key, {
              author: { id: person.id, name: person.name },
              at: Date.now(),
              text,
            })
          }
        />
      )}
      {here.length === 0 && (
        <Empty icon={<IconMessageCircle size={20} />} title="Nothing said yet">
          {action === null
            ? "Select an action to say something about it. Everybody in the graph can answer."
            : "Ask, warn, or explain. Everybody in the graph can answer."}
        </Empty>
      )}
      <ul className={style.list}>
        {(done ? here : open).map((thread) => (
          <ThreadCard
            key={thread.id}
            thread={thread}
            place={action === null ? endName(context.graph, thread.about) : null}
            onPlace={() => go(thread.about)}
          />
        ))}
      </ul>
      {resolved > 0 && (
        <Button size="compact-sm" variant="subtle" onClick={() => setDone(!done)}>
          {done ? "Hide resolved" : `Show ${resolved} resolved`}
        </Button>
      )}
      {here.length > 0 && (
        <Tooltip
          width={260}
          onFocus
          label="A comment carries the name that its page wrote. The history of the graph shows who stored each change; that the server vouches for."
        >
          {/* biome-ignore lint/a11y/noNoninteractiveTabindex: so that the words can be had by keyboard */}
          <p className={style.proof} tabIndex={0}>
            How sure are the names?
          </p>
        </Tooltip>
      )}
    </div>
  );
}
