/** Graphs that use older parameters: what an update would change in each, and the update. */
import { Button, Checkbox, Loader, Modal, Skeleton } from "@mantine/core";
import { IconCheck } from "@tabler/icons-react";
import { useId } from "react";
import { Link } from "wouter";
import type { ActionUse, UpdatedUse } from "../../api/documents/library";
import { errorText } from "../../api/http";
import { DifferenceView } from "../../history/difference-view";
import { isolated } from "../../words/isolated";
import { RenameChoices } from "./rename-fields";
import style from "./update-dialog.module.css";
import { type Update, useUpdate } from "./use-update";

interface Props {
  id: string;
  name: string;
  mayEdit: boolean;
  opened: boolean;
  onClose: () => void;
}

interface UseProps {
  use: ActionUse;
  update: Update;
  mayEdit: boolean;
}

function Use({ use, update, mayEdit }: UseProps) {
  const title = useId();
  const { graph, name, count, difference } = use;
  return (
    <li className={style.use} aria-labelledby={title}>
      <div className={style.head}>
        {mayEdit && (
          <Checkbox
            aria-label={`Update ${isolated(name || "Untitled")}`}
            checked={!update.isLeft(graph)}
            disabled={update.busy}
            onChange={() => update.leave(graph)}
          />
        )}
        <h3 id={title}>
          <bdi>{name || "Untitled"}</bdi>
        </h3>
        <span className={style.quiet}>{count === 1 ? "used once" : `used ${count} times`}</span>
      </div>
      {difference && (
        <DifferenceView found={difference} label={`What changes in ${isolated(name)}`} />
      )}
    </li>
  );
}

function Done({ done, update }: { done: readonly UpdatedUse[]; update: Update }) {
  const changed = done.filter((each) => each.changed);
  if (done.length === 0) return null;
  const nameOf = (graph: string) =>
    update.uses.find((use) => use.graph === graph)?.name || "Untitled";
  return (
    <section className={style.done} role="status">
      <p>
        <IconCheck size={15} aria-hidden />{" "}
        {changed.length === 1 ? "1 graph is updated" : `${changed.length} graphs are updated`} and
        saved. The history of each leads back.
      </p>
      <ul aria-label="Updated graphs">
        {changed.map(({ graph }) => (
          <li key={graph}>
            <bdi>{nameOf(graph)}</bdi>
            <Link to={`/graphs/${graph}?history`}>
              History<span className="visually-hidden"> of {isolated(nameOf(graph))}</span>
            </Link>
          </li>
        ))}
      </ul>
    </section>
  );
}

function Body({ id, mayEdit, onClose }: Props) {
  const update = useUpdate(id);
  const { found, uses, chosen } = update;
  if (found.isPending) return <Skeleton height={160} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  const older = uses.filter((use) => use.changed);
  const count = chosen.length === 1 ? "1 graph" : `${chosen.length} graphs`;
  return (
    <div aria-busy={update.renewing}>
      {update.wrong !== "" && (
        <p className={style.conflict} role="alert">
          {update.wrong}
        </p>
      )}
      <Done done={update.done} update={update} />
      {mayEdit && <RenameChoices update={update} />}
      {older.length === 0 ? (
        <p>Every graph uses the parameters as they are.</p>
      ) : (
        <ul className={style.uses}>
          {older.map((use) => (
            <Use key={use.graph} use={use} update={update} mayEdit={mayEdit} />
          ))}
        </ul>
      )}
      <div className={style.answers}>
        {update.renewing && <Loader size="xs" aria-label="Working out what would change" />}
        <Button onClick={onClose}>Close</Button>
        {mayEdit && older.length > 0 && (
          <Button
            variant="filled"
            loading={update.busy}
            disabled={chosen.length === 0 || update.renewing}
            onClick={() => void update.update()}
          >
            Update {count}
          </Button>
        )}
      </div>
    </div>
  );
}

export function UpdateDialog(props: Props) {
  return (
    <Modal
      opened={props.opened}
      onClose={props.onClose}
      title={`Graphs that use ${isolated(props.name)}`}
      size="xl"
    >
      <Body {...props} />
    </Modal>
  );
}
