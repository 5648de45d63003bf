/** The panel of comments on an action, or on all: threads with answers, done or open. */

import { Button, NativeSelect } from "@mantine/core";
import { IconMessageCircle } from "@tabler/icons-react";
import { useState } from "react";
import { useSearch } from "wouter";
import { usePerson } from "../api/people";
import { serverNow } from "../clock/server-clock";
import { selectedActions, useEditorContext } from "../edit-actions/editor-context";
import { commentIn } from "../edit-actions/graph-links";
import { beginThread, type Thread } from "../graph/edit/comments";
import { pathWords } from "../graph/field-words";
import type { Action, Key } from "../graph/model";
import { endName } from "../graph/relation-words";
import { Empty } from "../ui/empty";
import { Tooltip } from "../ui/tooltip";
import { isolated } from "../words/isolated";
import style from "./comments.module.css";
import { ThreadCard } from "./thread-card";
import { Write } from "./write";

/** `in/speed` as people call it. */
const parameterWords = (parameter: string): string =>
  parameter.startsWith("out/")
    ? `output ${pathWords(parameter.slice(4))}`
    : pathWords(parameter.replace(/^in\//, ""));

/** Begins a thread about an action, or one of its parameters. */
function Begin({ action, name }: { action: Action; name: string }) {
  const { doc, id } = useEditorContext();
  const { person } = usePerson();
  const [parameter, setParameter] = useState("");
  const all = [
    ...action.inputs.map(({ path }) => `in/${path}`),
    ...action.outputs.map(({ path }) => `out/${path}`),
  ];
  const author = { id: person.id, name: person.name };
  const say = (text: string, mentions: readonly string[]) => {
    const words = { author, at: serverNow(), text, mentions };
    beginThread(doc, action.key, words, parameter || null);
    setParameter("");
  };
  return (
    <Write
      place={[id, action.key]}
      label={`Comment on ${isolated(name)}`}
      button="Comment"
      onSay={say}
    >
      {all.length > 0 && (
        <NativeSelect
          size="xs"
          aria-label="What it is about"
          value={all.includes(parameter) ? parameter : ""}
          data={[
            { value: "", label: "about the action" },
            ...all.map((each) => ({ value: each, label: `about ${parameterWords(each)}` })),
          ]}
          onChange={(event) => setParameter(event.currentTarget.value)}
        />
      )}
    </Write>
  );
}

/** Comments carry names that pages wrote. */
function Proof() {
  return (
    <Tooltip
      width={260}
      onFocus
      label="The browser of its author wrote the name on a comment, and the server did not check it. The history shows who stored each change: the server has checked these names."
    >
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: so that the words can be had by keyboard */}
      <p className={style.proof} tabIndex={0}>
        How sure are the names?
      </p>
    </Tooltip>
  );
}

interface Props {
  threads: readonly Thread[];
  /** The one action that there is; without it that which is chosen, or all. */
  only?: Action;
}

export function Comments({ threads, only }: Props) {
  const context = useEditorContext();
  const [isDoneShown, setDone] = useState(false);
  const [chosen = null] = selectedActions(context);
  const action = only ?? chosen;
  const here = threads.filter((thread) => action === null || thread.about === action.key);
  const open = here.filter((thread) => !thread.resolved);
  const asked = commentIn(useSearch());
  // A link to a comment shows it, also where its thread is resolved.
  const done = isDoneShown || here.some(({ id, resolved }) => resolved && id === asked);
  const resolved = here.length - open.length;
  const go = (about: Key) => {
    context.select([about]);
    context.view.show([about]);
  };
  const place = ({ about, parameter }: Thread) =>
    [action === null && endName(context.graph, about), parameter && parameterWords(parameter)]
      .filter(Boolean)
      .join(" · ") || null;
  return (
    <div className={style.comments}>
      {action !== null && context.mayEdit && (
        <Begin
          key={action.key}
          action={action}
          name={only?.name ?? endName(context.graph, action.key)}
        />
      )}
      {here.length === 0 && (
        <Empty icon={<IconMessageCircle size={20} />} title="Nothing said yet">
          {action === null
            ? "Select an action to say something about it. Everybody in the graph can answer."
            : "Ask, warn, or explain. Everybody here can answer."}
        </Empty>
      )}
      <ul className={style.list}>
        {(done ? here : open).map((thread) => (
          <ThreadCard
            key={thread.id}
            thread={thread}
            place={place(thread)}
            onPlace={action === null ? () => go(thread.about) : undefined}
          />
        ))}
      </ul>
      {resolved > 0 && (
        <Button size="compact-sm" variant="subtle" onClick={() => setDone(!done)}>
          {done ? "Hide resolved" : `Show ${resolved} resolved`}
        </Button>
      )}
      {here.length > 0 && <Proof />}
    </div>
  );
}
