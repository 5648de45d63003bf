/** Fields that this person changed while away and others changed, too: both values, to choose from. */
import { Button, Group, Modal, Radio, Stack, Text } from "@mantine/core";
import { useRoom } from "../sync/use-room";
import type { ToldTwice } from "./changed-twice-words";
import style from "./stranded-edits-dialog.module.css";

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

export function ChangedTwiceDialog({
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
