/** The dialog that replaces an action of the library by a robot's version, and shows the difference first. */
import { Button, Modal, Skeleton } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { useQuery, useQueryClient } from "@tanstack/react-query";
import { useState } from "react";
import { refreshLibrary } from "../api/graphs";
import { errorText } from "../api/http";
import { compareWithFile, replaceAction } from "../api/library";
import { useLive } from "../api/page-link";
import { indexedAction } from "../api/robots";
import { DifferenceView, meansSomething } from "../differences/difference-view";
import type { RobotAction } from "../home/robot-actions";
import { isolated } from "../words/isolated";
import style from "./update-dialog.module.css";

interface Props {
  /** The id of the action's document. */
  id: string;
  has: RobotAction;
  opened: boolean;
  onClose: () => void;
}

/** Load the robot's file of an action, and what it would change in the library. */
function useFileOf(id: string, { robot, action }: RobotAction) {
  const { runner } = useLive();
  return useQuery({
    queryKey: ["take-over", id, robot, action.name],
    queryFn: async () => {
      const text = await indexedAction(runner ?? "", robot, action.name);
      return { text, difference: await compareWithFile(id, text) };
    },
    enabled: runner !== undefined,
    staleTime: 0,
    gcTime: 0,
    refetchOnWindowFocus: false,
  });
}

function useTaking({ id, has, onClose }: Props) {
  const client = useQueryClient();
  const found = useFileOf(id, has);
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  const take = async ({ text, difference }: NonNullable<typeof found.data>) => {
    setBusy(true);
    setWrong("");
    try {
      await replaceAction(id, text, difference.after);
      notifications.show({
        message: `The library now has the definition of ${isolated(has.robot)}. Its history can restore the earlier one.`,
      });
      onClose();
    } catch (error) {
      setWrong(errorText(error));
      await found.refetch(); // the action may have changed meanwhile
    } finally {
      await refreshLibrary(client);
      setBusy(false);
    }
  };
  return { found, busy, wrong, take };
}

function Body(props: Props) {
  const { has, onClose } = props;
  const { found, busy, wrong, take } = useTaking(props);
  const { data } = found;
  const some = data !== undefined && meansSomething(data.difference);
  return (
    <div aria-busy={found.isFetching}>
      {wrong !== "" && (
        <p className={style.conflict} role="alert">
          {wrong}
        </p>
      )}
      {found.isPending && <Skeleton height={120} />}
      {found.isError && <p role="alert">{errorText(found.error)}</p>}
      {data && !some && <p>The file that {isolated(has.robot)} has says the same.</p>}
      {data && some && <DifferenceView found={data.difference} label="What would change" />}
      <div className={style.answers}>
        <Button onClick={onClose}>Close</Button>
        {data && some && (
          <Button
            variant="filled"
            loading={busy}
            disabled={found.isFetching}
            onClick={() => void take(data)}
          >
            Take over
          </Button>
        )}
      </div>
    </div>
  );
}

export function TakeOverDialog(props: Props) {
  const { has, opened, onClose } = props;
  return (
    <Modal
      opened={opened}
      onClose={onClose}
      title={`Take over ${isolated(has.action.name)} from ${isolated(has.robot)}`}
      size="lg"
    >
      <Body {...props} />
    </Modal>
  );
}
