/** “Since when?” of a run that did not end well: which edit made its graph go another way. */
import { Button, Loader, Modal } from "@mantine/core";
import { IconHistory } from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import { type SinceAnswer, type SinceWhen, useSince } from "../../api/documents/since";
import { authorName } from "../../api/graphs";
import { errorText } from "../../api/http";
import type { Run } from "../../api/runs";
import { DifferenceView } from "../../history/difference-view";
import { clock, day, instant, useNow } from "../../ui/times";
import { isolated } from "../../words/isolated";
import style from "./since-when.module.css";

type CourseChange = SinceWhen["partings"][number];

interface Props {
  runner: string | undefined;
  run: Run;
}

function PlaceView({ place, graph }: { place: CourseChange; graph: string }) {
  const now = useNow(60_000);
  const at = instant(place.at);
  const changes = place.changes;
  return (
    <li>
      <p>
        <b>
          <bdi>{authorName(place.author)}</bdi>
          {at === null ? "" : `, ${day(at, now)} ${clock(at)}`}
        </b>
        : from this edit on it goes {place.parts ? "another way" : "the first way again"}.{" "}
        <Link to={`/graphs/${graph}?at=${place.seq}`}>The graph then</Link>
      </p>
      <DifferenceView
        found={{ actions: [], relations: [], ...changes }}
        label={`What ${isolated(authorName(place.author))} changed`}
      />
      <p className={style.step}>
        Step {place.place}: <del>{place.before}</del> <ins>{place.after}</ins>
      </p>
    </li>
  );
}

function Answer({ answer, graph }: { answer: SinceAnswer; graph: string }) {
  const { good, found } = answer;
  if (good === null || found === null) {
    return <p>No run of this graph before it went well, so there is nothing to compare it with.</p>;
  }
  const since = `since run ${good.number}, which went well`;
  return (
    <>
      {found.partings.length === 0 ? (
        <p>
          No edit {since} explains it: with what the actions of this run did, the graph went the
          same way then.
        </p>
      ) : (
        <ol className={style.places} aria-label="Where it goes another way">
          {found.partings.map((place) => (
            <PlaceView key={place.seq} place={place} graph={graph} />
          ))}
        </ol>
      )}
      <p className={style.quiet}>
        {found.looked} {found.looked === 1 ? "moment" : "moments"} {since}, simulated with what the
        actions of this run did.
        {found.exact ? "" : " It may have changed and changed back between two of them."}
      </p>
    </>
  );
}

export function SinceWhenButton({ runner, run }: Props) {
  const [open, setOpen] = useState(false);
  const asked = useSince(runner, run, open);
  if (run.graph === null || run.version === null || run.ended_at === null) return null;
  return (
    <>
      <Button
        size="compact-sm"
        variant="light"
        leftSection={<IconHistory size={14} aria-hidden />}
        onClick={() => setOpen(true)}
      >
        Since when?
      </Button>
      <Modal opened={open} onClose={() => setOpen(false)} title="Since when?" size="lg">
        {asked.isPending && (
          <p role="status" className={style.waiting}>
            <Loader size="xs" /> Past moments of the graph are simulated…
          </p>
        )}
        {asked.isError && <p role="alert">{errorText(asked.error)}</p>}
        {asked.data !== undefined && <Answer answer={asked.data} graph={run.graph} />}
      </Modal>
    </>
  );
}
