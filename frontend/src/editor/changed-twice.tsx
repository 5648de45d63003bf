/** Fields that this person and others changed while this person was offline: a notice, and a dialog to choose a value. */

import { Button, Group, Modal, Radio, Stack, Text } from "@mantine/core";
import { IconGitMerge } from "@tabler/icons-react";
import { useState } from "react";
import { changesOf, type ValuesByRoot } from "../graph/changes";
import { type Maps, mapsFrom, mapsOf, type Root } from "../graph/document-keys";
import type { ChangedTwice } from "../sync/changed-twice";
import { useGraph, useRoom } from "../sync/use-room";
import { Say } from "./room-notice";
import style from "./stranded-edits-dialog.module.css";

interface ToldTwice {
  readonly twice: ChangedTwice;
  /** "Look: Description". */
  readonly title: string;
  readonly mine: string;
  readonly theirs: string;
}

/** In words; null for what no person has changed, such as an order that follows from something else. */
function toldOf(twice: ChangedTwice, here: Maps): ToldTwice | null {
  const { root, key, mine, theirs, writes } = twice;
  const [change] = changesOf(
    { difference: only(root, key, mine), before: only(root, key, theirs), here },
    here,
  );
  const [line] = change?.lines ?? [];
  if (change === undefined || line === undefined) return null;
  const isWhole = writes.mine.length > 1 || (writes.theirs?.length ?? 0) > 1;
  const unknown = "another value, which the history has";
  const nothing = isWhole ? "Deleted" : "Nothing";
  return {
    twice,
    title: isWhole ? change.title : `${change.title}: ${line.field}`,
    mine: line.after ?? nothing,
    theirs: writes.theirs === null ? unknown : (line.before ?? nothing),
  };
}

function only(root: Root, key: string, value: unknown): ValuesByRoot {
  return mapsFrom({ [root]: { [key]: value } });
}

/** What there is to choose from, in words. */
function useChangedTwiceTold(all: readonly ChangedTwice[]): readonly ToldTwice[] {
  const { doc } = useRoom();
  useGraph(); // the names in it
  if (all.length === 0) return [];
  const here = mapsOf(doc);
  return all.flatMap((twice) => toldOf(twice, here) ?? []);
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
        While you were away, you and others changed the same. What is marked stands now; choose
        another value where it should. Each choice is an edit that you can undo, and the history has
        both.
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

export function ChangedTwiceNotice({ all }: { all: readonly ChangedTwice[] }) {
  const told = useChangedTwiceTold(all);
  const [open, setOpen] = useState(false);
  if (told.length === 0) return null;
  return (
    <Say
      icon={<IconGitMerge size={16} />}
      tone="warn"
      action={
        <Button size="compact-sm" onClick={() => setOpen(true)}>
          Choose
        </Button>
      }
    >
      While you were away, others changed{" "}
      {told.length === 1 ? "something" : `${told.length} things`} that you changed, too. One of both
      values stands.
      <ChangedTwiceDialog told={told} opened={open} onClose={() => setOpen(false)} />
    </Say>
  );
}
