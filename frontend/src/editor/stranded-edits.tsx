/** Edits that are kept on this device and cannot be sent: this person's and others'. They can be applied, discarded or saved as a file. */

import { Button, Checkbox, Group, Modal, Text } from "@mantine/core";
import { useMutation } from "@tanstack/react-query";
import { useMemo, useState } from "react";
import { type ChangedField, changesOf, type GraphChange, onlyChanges } from "../graph/changes";
import { type Maps, mapsFrom, mapsOf } from "../graph/document-keys";
import type { OtherPerson } from "../sync/indexed-db";
import type { StrandedEdits } from "../sync/replaced-history";
import {
  type OthersWaiting,
  type StrandedEditsChoice,
  useGraph,
  useLink,
  useRoom,
  useStrandedEdits,
} from "../sync/use-room";
import { counted } from "../words/counted";
import notices from "./room-notices.module.css";
import style from "./stranded-edits-dialog.module.css";

interface ChangesFile {
  readonly graph: string;
  readonly made_by: string;
  /** Time of the last of these edits. */
  readonly made_at: string;
  readonly changes: readonly {
    readonly what: string;
    readonly values: readonly { field: string; before: string | null; after: string | null }[];
  }[];
  /** The whole graph including these changes, by key, as in the shared document. */
  readonly document: { readonly [root: string]: Readonly<Record<string, unknown>> };
}

/** Return a change in one line, such as "changed action Look". */
function changeSentence({ kind, thing, title }: GraphChange): string {
  return thing === "graph" ? `${kind} the graph` : `${kind} ${thing} ${title}`;
}

function fileOf(graph: string, by: string, stranded: StrandedEdits): ChangesFile {
  const changes = changesOf(stranded, mapsFrom({})).map((change) => ({
    what: changeSentence(change),
    values: change.lines.map(({ field, before, after }) => ({ field, before, after })),
  }));
  const made_at = new Date(stranded.at).toISOString();
  return { graph, made_by: by, made_at, changes, document: plain(stranded.here) };
}

/** Downloads the changes as a JSON file. */
function saveChanges(graph: string, by: string, all: readonly StrandedEdits[]): void {
  const content = all.map((stranded) => fileOf(graph, by, stranded));
  const text = JSON.stringify(content.length === 1 ? content[0] : content, null, 2);
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type: "application/json" }));
  link.download = `${graph || "graph"} - changes of ${by || "a guest"}.json`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}

function plain(maps: Maps): ChangesFile["document"] {
  return Object.fromEntries(
    Object.entries(maps).map(([root, map]) => [root, Object.fromEntries(map)]),
  );
}

interface OthersProps {
  graph: string;
  waiting: OthersWaiting;
  opened: boolean;
  onClose: () => void;
}

export function OthersDialog({ graph, waiting, opened, onClose }: OthersProps) {
  const { others, read, forget } = waiting;
  const [sure, setSure] = useState<string | null>(null);
  const name = (other: OtherPerson) => other.name || "a guest";
  const save = async (other: OtherPerson) => saveChanges(graph, name(other), await read(other.id));
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title="Unsaved changes that other people made on this device"
      closeButtonProps={{ "aria-label": "Close" }}
      centered
    >
      <Text>They are sent when the person signs in here again, and never under another name.</Text>
      <ul className={notices.others}>
        {others.map((other) => (
          <li key={other.id}>
            <b>{name(other)}</b>
            <span>{counted(other.waiting, "change")}</span>
            <Button size="compact-sm" onClick={() => save(other)}>
              Save as a file
            </Button>
            {sure === other.id ? (
              <Button size="compact-sm" color="red" onClick={() => forget(other.id)}>
                Discard for good
              </Button>
            ) : (
              <Button size="compact-sm" onClick={() => setSure(other.id)}>
                Discard
              </Button>
            )}
          </li>
        ))}
      </ul>
    </Modal>
  );
}

const signs = { added: "+", removed: "−", changed: "~" } as const;

function Lines({ lines }: { lines: readonly ChangedField[] }) {
  return (
    <ul className={style.lines}>
      {lines.map((line) => (
        <li key={line.field}>
          <span className={style.field}>{line.field}</span>{" "}
          {line.before !== null && <del className="ink2">{line.before}</del>}
          {line.before !== null && line.after !== null && (
            <>
              {" "}
              <span aria-hidden>→</span>
              <span className="visually-hidden">becomes</span>{" "}
            </>
          )}
          {line.after !== null && <ins className="weight-600 no-underline">{line.after}</ins>}
          {line.now !== undefined && (
            <span className={style.now}> now {line.now ?? "nothing"}</span>
          )}
        </li>
      ))}
    </ul>
  );
}

interface ItemProps {
  change: GraphChange;
  taken: boolean;
  onTake: (taken: boolean) => void;
}

function Item({ change, taken, onTake }: ItemProps) {
  const { kind, lines } = change;
  // The title has the name already.
  const told = kind === "changed" ? lines : lines.filter(({ field }) => field !== "Name");
  return (
    <li className={style.item} data-kind={change.kind}>
      <Checkbox
        checked={taken}
        onChange={(event) => onTake(event.currentTarget.checked)}
        label={
          <>
            <span className={style.sign} aria-hidden>
              {signs[change.kind]}
            </span>
            <span className="visually-hidden">{changeSentence(change)}</span>
            <b aria-hidden>{change.title}</b>{" "}
            <span className={style.thing} aria-hidden>
              {change.thing === "graph" ? "" : `${change.thing} `}
              {change.kind}
            </span>
          </>
        }
      />
      <Lines lines={told} />
    </li>
  );
}

function causeOf({ refused }: StrandedEdits, what: string, when: string): string {
  if (refused === undefined) {
    return `A backup was restored on the server. ${what} that you made here (the last at ${when}) were not stored by then.`;
  }
  const why =
    refused === "full"
      ? "This graph is full: it may have 5,000 actions and 32 MiB."
      : "The server refused a change.";
  return `${why} Not stored: ${what} that you made here (the last at ${when}). All your other changes are stored.`;
}

interface BodyProps {
  choice: StrandedEditsChoice;
  by: string;
  onLater: () => void;
}

function Body({ choice, by, onLater }: BodyProps) {
  const { stranded } = choice;
  const { doc } = useRoom();
  const graph = useGraph();
  // biome-ignore lint/correctness/useExhaustiveDependencies: the document changes with the graph
  const all = useMemo(() => changesOf(stranded, mapsOf(doc)), [stranded, doc, graph]);
  const [left, setLeft] = useState<ReadonlySet<string>>(new Set());
  const taken = all.filter(({ id }) => !left.has(id));
  const take = (id: string, on: boolean) => {
    const next = new Set(left);
    if (on) next.delete(id);
    else next.add(id);
    setLeft(next);
  };
  const when = new Date(stranded.at).toLocaleString([], {
    dateStyle: "medium",
    timeStyle: "short",
  });
  return (
    <>
      <Text>
        {causeOf(stranded, counted(all.length, "change"), when)} Behind this dialog you see the
        graph as it is now. Which of these changes should be applied to it?
      </Text>
      <Group mt="xs" gap="xs" className={style.marks ?? ""}>
        <Button size="compact-sm" onClick={() => setLeft(new Set())}>
          Mark all
        </Button>
        <Button size="compact-sm" onClick={() => setLeft(new Set(all.map(({ id }) => id)))}>
          Mark none
        </Button>
      </Group>
      <ul className={style.list} aria-label="Your changes">
        {all.map((change) => (
          <Item
            key={change.id}
            change={change}
            taken={!left.has(change.id)}
            onTake={(on) => take(change.id, on)}
          />
        ))}
      </ul>
      <Answers
        choice={choice}
        taken={taken}
        some={taken.length < all.length ? `${taken.length} of ${all.length}` : "all"}
        onLater={onLater}
        onSave={() => saveChanges(graph.name, by, [stranded])}
      />
    </>
  );
}

interface AnswersProps {
  choice: StrandedEditsChoice;
  taken: readonly GraphChange[];
  /** The number of chosen changes, in words. */
  some: string;
  onLater: () => void;
  onSave: () => void;
}

function Answers({ choice, taken, some, onLater, onSave }: AnswersProps) {
  const { state } = useLink();
  const [dropping, setDropping] = useState(false);
  const work = useMutation({ mutationFn: (edit: () => Promise<unknown>) => edit() });
  // After a success the dialog closes by itself.
  const busy = work.isPending || work.isSuccess;
  const { difference } = choice.stranded;
  return (
    <>
      {work.error !== null && (
        <p className={style.trouble} role="alert">
          That did not work: {work.error.message}. Your changes are still here.
        </p>
      )}
      <div className={style.answers}>
        <Button onClick={onSave}>Save as a file</Button>
        <span className={style.space} />
        <Button onClick={onLater}>Decide later</Button>
        {dropping ? (
          <Button color="red" disabled={busy} onClick={() => work.mutate(() => choice.drop())}>
            Discard for good
          </Button>
        ) : (
          <Button disabled={busy} onClick={() => setDropping(true)}>
            Discard
          </Button>
        )}
        <Button
          variant="filled"
          data-autofocus
          loading={busy}
          disabled={taken.length === 0 || state !== "live"}
          onClick={() => work.mutate(() => choice.apply(onlyChanges(difference, taken)))}
        >
          Apply {some}
        </Button>
      </div>
    </>
  );
}

/** Shows edits that the server did not take. `onLater`: closes it; a notice on the page reopens it. */
export function StrandedEditsDialog({
  by,
  open,
  onLater,
}: {
  by: string;
  open: boolean;
  onLater(): void;
}) {
  const choice = useStrandedEdits();
  return (
    <Modal
      opened={choice !== null && open}
      onClose={onLater}
      title={
        choice?.stranded.refused === undefined
          ? "Your changes and a restored backup"
          : "Your changes that were not stored"
      }
      closeButtonProps={{ "aria-label": "Decide later" }}
      size="lg"
      centered
    >
      {choice && <Body key={choice.stranded.at} choice={choice} by={by} onLater={onLater} />}
    </Modal>
  );
}
