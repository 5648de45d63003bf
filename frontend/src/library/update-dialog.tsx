/** Updates graphs to the current parameters of an action, and shows what would change in each first. */

import { Button, Checkbox, Loader, Modal, NativeSelect, Skeleton } from "@mantine/core";
import { IconCheck } from "@tabler/icons-react";
import { useQueryClient } from "@tanstack/react-query";
import { useId, useState } from "react";
import { Link } from "wouter";
import { refreshGraphs, refreshLibrary } from "../api/graphs";
import { errorText, Refusal } from "../api/http";
import {
  type ActionUse,
  type ActionUses,
  NO_RENAMES,
  refreshUses,
  type UpdatedUse,
  updateUses,
  useActionUses,
} from "../api/library";
import { refusedAt } from "../api/refusal-places";
import { DifferenceView } from "../differences/difference-view";
import { pathWords } from "../graph/field-words";
import { counted } from "../words/counted";
import { isolated } from "../words/isolated";
import {
  clashes,
  keyOfRename,
  possibleRenames,
  renamesOf,
  type SuggestedRename,
  suggestedRenames,
} from "./rename-choices";
import style from "./update-dialog.module.css";

function words(error: unknown, uses: readonly ActionUse[]): string {
  const place = uses.find(({ graph }) => graph === refusedAt(error, "graph"))?.name;
  const text = place === undefined ? errorText(error) : `${place}: ${errorText(error)}`;
  const changed = error instanceof Refusal && error.details.status === 409;
  return changed
    ? `${text} Nothing was written. See below what would change now.`
    : `${text} See below what would still change.`;
}

const toggled = (set: ReadonlySet<string>, key: string): ReadonlySet<string> => {
  const next = new Set(set);
  if (!next.delete(key)) next.add(key);
  return next;
};

/** Keeps the choices of a person: the renames to make, and the graphs to leave out. */
function useTicks(id: string) {
  const [ticked, setTicked] = useState<ReadonlySet<string>>(new Set());
  const [left, setLeft] = useState<ReadonlySet<string>>(new Set());
  // Suggestions are those without any chosen rename; with one, it is not suggested again.
  const plain = useActionUses(id, NO_RENAMES);
  const uses = plain.data?.uses ?? [];
  const suggested = suggestedRenames(uses);
  const possible = possibleRenames(uses, suggested);
  const all = [...suggested, ...possible];
  const renames = renamesOf(ticked, all);
  const described = (each: SuggestedRename) => ({
    ...each,
    key: keyOfRename(each),
    ticked: ticked.has(keyOfRename(each)),
    clashes: clashes(each, ticked, all),
  });
  return {
    renames,
    suggested: suggested.map(described),
    possible: possible.map(described),
    tick: (key: string) => setTicked((now) => toggled(now, key)),
    /** Choose one of several renames that exclude each other, or none. */
    choose: (others: readonly string[], key: string) =>
      setTicked(
        (now) => new Set([...now].filter((each) => !others.includes(each)).concat(key || [])),
      ),
    isLeft: (graph: string) => left.has(graph),
    leave: (graph: string) => setLeft((now) => toggled(now, graph)),
  };
}

function useUpdate(id: string) {
  const client = useQueryClient();
  const { renames, isLeft, ...ticks } = useTicks(id);
  const found = useActionUses(id, renames);
  const [busy, setBusy] = useState(false);
  const [wrong, setWrong] = useState("");
  const [done, setDone] = useState<readonly UpdatedUse[]>([]);
  const uses = found.data?.uses ?? [];
  const chosen = uses.filter((use) => use.changed && !isLeft(use.graph));
  const update = async ({ seq }: ActionUses) => {
    setBusy(true);
    setWrong("");
    try {
      const graphs = chosen.map(({ graph, seq }) => ({ graph, seq }));
      setDone(await updateUses(id, { seq, graphs, renames }));
    } catch (error) {
      setWrong(words(error, uses));
    } finally {
      await Promise.all([refreshUses(client, id), refreshLibrary(client), refreshGraphs(client)]);
      setBusy(false);
    }
  };
  return {
    ...ticks,
    found,
    uses,
    chosen,
    isLeft,
    busy,
    wrong,
    done,
    /** True if the preview is outdated, because other renames are chosen or it is being loaded. */
    renewing: found.isPlaceholderData || found.isFetching,
    update: () => (found.data ? update(found.data) : Promise.resolve()),
  };
}

type Update = ReturnType<typeof useUpdate>;

type Rename = Update["possible"][number];

const nameOf = ({ side, from }: Rename): string =>
  `${side === "in" ? "" : "output "}${pathWords(from)}`;

/** Offers, for each removed parameter, the names that it may have now. */
function OtherRenames({ update }: { update: Update }) {
  const names = [...new Set(update.possible.map(nameOf))];
  if (names.length === 0) return null;
  return (
    <details className={style.others}>
      <summary className="ink2 cursor-pointer">
        {update.suggested.length > 0 ? "Something else was" : "Choose what was"} only renamed
      </summary>
      {names.map((name) => {
        const choices = update.possible.filter((each) => nameOf(each) === name);
        return (
          <NativeSelect
            key={name}
            label={`${isolated(name)} is`}
            disabled={update.busy}
            value={choices.find(({ ticked }) => ticked)?.key ?? ""}
            data={[
              { value: "", label: "gone" },
              ...choices.map(({ key, to, ticked, clashes }) => ({
                value: key,
                label: `now ${pathWords(to)}`,
                disabled: clashes && !ticked && !choices.some((other) => other.ticked),
              })),
            ]}
            onChange={(event) =>
              update.choose(
                choices.map(({ key }) => key),
                event.currentTarget.value,
              )
            }
          />
        );
      })}
    </details>
  );
}

function RenameChoices({ update }: { update: Update }) {
  if (update.suggested.length + update.possible.length === 0) return null;
  return (
    <fieldset className={style.renames}>
      <legend>Only renamed? Then the value is kept under the new name.</legend>
      {update.suggested.map((each) => (
        <Checkbox
          key={each.key}
          label={`${isolated(nameOf(each))} is now ${pathWords(each.to)}`}
          checked={each.ticked}
          disabled={update.busy || (each.clashes && !each.ticked)}
          onChange={() => update.tick(each.key)}
        />
      ))}
      <OtherRenames update={update} />
    </fieldset>
  );
}

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
        <h3 className="m-0 break-anywhere text-13" id={title}>
          <bdi>{name || "Untitled"}</bdi>
        </h3>
        <span className="faint-12">{count === 1 ? "used once" : `used ${count} times`}</span>
      </div>
      {difference && (
        <DifferenceView found={difference} label={`What changes in ${isolated(name)}`} />
      )}
    </li>
  );
}

function UpdatedGraphs({ done, update }: { done: readonly UpdatedUse[]; update: Update }) {
  const changed = done.filter((each) => each.changed);
  const refused = done.filter((each) => each.refused);
  if (done.length === 0) return null;
  const nameOf = (graph: string) =>
    update.uses.find((use) => use.graph === graph)?.name || "Untitled";
  return (
    <section className={style.done} role="status">
      <p>
        <IconCheck size={15} aria-hidden />{" "}
        {changed.length === 1 ? "1 graph is updated" : `${changed.length} graphs are updated`} and
        saved. The history of each can restore the earlier version.
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
      {refused.length > 0 && (
        <div className={style.conflict} role="alert">
          {`The update of ${counted(refused.length, "graph")} failed:`}
          <ul aria-label="Graphs whose update failed">
            {refused.map(({ graph, refused }) => (
              <li key={graph}>
                <bdi>{nameOf(graph)}</bdi>
                <span>{refused}</span>
              </li>
            ))}
          </ul>
        </div>
      )}
    </section>
  );
}

function Body({ id, mayEdit, onClose }: Props) {
  const update = useUpdate(id);
  const { found, uses, chosen } = update;
  if (found.isPending) return <Skeleton height={160} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  const older = uses.filter((use) => use.changed);
  return (
    <div aria-busy={update.renewing}>
      {update.wrong !== "" && (
        <p className={style.conflict} role="alert">
          {update.wrong}
        </p>
      )}
      <UpdatedGraphs done={update.done} update={update} />
      {mayEdit && <RenameChoices update={update} />}
      {older.length === 0 ? (
        <p>Every graph uses the current parameters.</p>
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
            Update {counted(chosen.length, "graph")}
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
