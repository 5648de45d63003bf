/** A notice and a dialog about fields that this person and others changed without seeing each other's edit. */

import { Button, Group, Modal, Radio, Stack, Text } from "@mantine/core";
import { IconGitMerge } from "@tabler/icons-react";
import { useQuery } from "@tanstack/react-query";
import { useState } from "react";
import { fetchChanges } from "../api/history";
import { errorText } from "../api/http";
import { usePerson } from "../api/people";
import { useEditorContext } from "../edit-actions/editor-context";
import { changesOf, type ValuesByRoot } from "../graph/changes";
import { type Maps, mapsFrom, mapsOf, type Root } from "../graph/document-keys";
import { asLogged } from "../sync/changed-twice";
import type { ChangedTwice } from "../sync/indexed-db";
import { useGraph, useRoom } from "../sync/use-room";
import { Notice } from "./room-notice";
import style from "./stranded-edits-dialog.module.css";

interface ToldTwice {
  readonly twice: ChangedTwice;
  /** The changed field, such as "Look: Description". */
  readonly title: string;
  readonly mine: string;
  readonly theirs: string;
}

/**
 * Return both values in words; null for fields that people do not set themselves, such as an order.
 * `unknown`: the words for a value that is not loaded.
 */
function toldOf(twice: ChangedTwice, here: Maps, unknown: string): ToldTwice | null {
  const { root, key, mine, theirs, writes } = twice;
  const [change] = changesOf(
    { difference: only(root, key, mine), before: only(root, key, theirs), here },
    here,
  );
  const [line] = change?.lines ?? [];
  if (change === undefined || line === undefined) return null;
  const isWhole = writes.mine.length > 1 || (writes.theirs?.length ?? 0) > 1;
  const nothing = isWhole ? "Deleted" : "Nothing";
  return {
    twice,
    title: isWhole ? change.title : `${change.title}: ${line.field}`,
    mine: line.after ?? nothing,
    theirs: writes.theirs === null ? unknown : (line.before ?? nothing),
  };
}

/** The server gives the newest so many steps in one answer. */
const MOST_STEPS = 5_000;

/** Reads values of others that came as collected from the log, when somebody `looks`. */
function useLogged(found: readonly ChangedTwice[], looks: boolean) {
  const { id } = useEditorContext();
  const { person } = usePerson();
  const collected = found.filter(({ writes }) => writes.theirs === null);
  const after = Math.min(...collected.map(({ since }) => since));
  const log = useQuery({
    enabled: looks && collected.length > 0,
    queryKey: ["changed-twice", id, ...collected.map((each) => `${each.since} ${each.id}`)],
    queryFn: ({ signal }) => fetchChanges(id, after, Number.MAX_SAFE_INTEGER, signal),
    staleTime: Number.POSITIVE_INFINITY,
    retry: false,
  });
  const { data, error } = log;
  const isWhole = data !== undefined && data.length < MOST_STEPS;
  const all = found.map((twice) =>
    data === undefined || twice.writes.theirs !== null
      ? twice
      : (asLogged(twice, data, person.id) ?? twice),
  );
  return { all, unknown: unknownWords(data && isWhole, error) };
}

/** `isWhole`: whether all steps since then were read; undefined while none are. */
function unknownWords(isWhole: boolean | undefined, error: Error | null): string {
  if (isWhole) return "another value, which the history does not show";
  if (isWhole === false)
    return "another value; too much changed since then to show it here: see the history";
  if (error === null) return "another value, which is being read from the history";
  return `another value; the history could not be read: ${errorText(error)}`;
}

function only(root: Root, key: string, value: unknown): ValuesByRoot {
  return mapsFrom({ [root]: { [key]: value } });
}

/** Return all fields with two values, in words. `looks`: loads values of others from the log. */
function useChangedTwiceTold(found: readonly ChangedTwice[], looks: boolean): readonly ToldTwice[] {
  const { doc } = useRoom();
  useGraph(); // renders again when names change
  const { all, unknown } = useLogged(found, looks);
  if (all.length === 0) return [];
  const here = mapsOf(doc);
  return all.flatMap((twice) => toldOf(twice, here, unknown) ?? []);
}

function Field({ told: { twice, title, mine, theirs } }: { told: ToldTwice }) {
  const { changedTwice } = useRoom().room;
  return (
    <li className={style.item}>
      <Radio.Group
        label={title}
        value={changedTwice.stands(twice)}
        onChange={(side) => changedTwice.choose(twice, side === "mine" ? "mine" : "theirs")}
      >
        <Stack gap={6} mt={6}>
          <Radio value="mine" label={`Yours: ${mine}`} />
          <Radio
            value="theirs"
            label={`Theirs: ${theirs}`}
            disabled={twice.writes.theirs === null}
          />
        </Stack>
      </Radio.Group>
    </li>
  );
}

function ChangedTwiceDialog({
  told,
  opened,
  onClose,
}: {
  told: readonly ToldTwice[];
  opened: boolean;
  onClose(): void;
}) {
  const { changedTwice } = useRoom().room;
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title="Changed by you and by others"
      closeButtonProps={{ "aria-label": "Decide later" }}
      size="lg"
      centered
    >
      <Text>
        You and others changed the same values, without seeing each other’s changes. The marked
        value is in the graph now; you can choose another one. Each choice is an edit that you can
        undo.
      </Text>
      <ul className={style.list} aria-label="Fields with two values">
        {told.map((each) => (
          <Field key={each.twice.id} told={each} />
        ))}
      </ul>
      <Group mt="md" justify="flex-end">
        <Button onClick={onClose}>Decide later</Button>
        <Button variant="filled" data-autofocus onClick={() => changedTwice.dismiss()}>
          Done
        </Button>
      </Group>
    </Modal>
  );
}

const things = (count: number) => (count === 1 ? "something" : `${count} things`);

export function ChangedTwiceNotice({ all }: { all: readonly ChangedTwice[] }) {
  const [open, setOpen] = useState(false);
  const told = useChangedTwiceTold(all, open);
  if (told.length === 0) return null;
  const unseen = told.filter(({ twice }) => twice.cause === "unseen").length;
  const away = told.length - unseen;
  return (
    <Notice
      icon={<IconGitMerge size={16} />}
      tone="warn"
      action={
        <Button size="compact-sm" onClick={() => setOpen(true)}>
          Choose
        </Button>
      }
    >
      {away > 0 && (
        <>
          While you were away, others changed {things(away)} that you changed, too. Only one of the
          two values is in the graph.{" "}
        </>
      )}
      {unseen > 0 && (
        <>
          Somebody who was offline, or on a slow network, replaced {things(unseen)} that you had
          changed, without having seen your change.
        </>
      )}
      <ChangedTwiceDialog told={told} opened={open} onClose={() => setOpen(false)} />
    </Notice>
  );
}
