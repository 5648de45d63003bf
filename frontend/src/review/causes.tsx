/** Causes of a run that did not end well, each with a link to the event that proves it. */

import { Button, Loader, Modal } from "@mantine/core";
import { IconAlertTriangle, IconHandStop, IconHistory } from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import { authorName } from "../api/graphs";
import { type SinceAnswer, type SinceWhen, useSince } from "../api/history";
import { errorText } from "../api/http";
import { NAMELESS, useCurrentName } from "../api/people";
import { type Cause, needsExplanation, useCauses } from "../api/review";
import type { Run } from "../api/runs";
import { DifferenceView } from "../differences/difference-view";
import { placesOf } from "../status/level-places";
import { clock, day, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./causes.module.css";

interface Props {
  runner: string | undefined;
  run: Run;
  /** Goes to a moment, and to an action as the run calls it. */
  onShow: (at: number, fact: string | null) => void;
}

const SHOWN = 3;

interface CauseLineProps extends Pick<Props, "onShow"> {
  cause: Cause;
  /** The action stands in a graph inside. */
  inside: boolean;
}

/** Return the sentence of a cause with the present `name` of a person who had none at that time. */
export function causeSentence({ text, author }: Pick<Cause, "text" | "author">, name: string) {
  const hasName = author && author.name === "" && name !== NAMELESS;
  return hasName ? text.replace(/^Somebody\b/, () => isolated(name)) : text;
}

function Line({ cause, inside, onShow }: CauseLineProps) {
  const at = instant(cause.at) ?? 0;
  const sentence = causeSentence(cause, useCurrentName(cause.author));
  const show = () => onShow(at, cause.action);
  return (
    <li>
      <button type="button" className={style.at} title="Show this moment" onClick={show}>
        {clock(at)}
      </button>
      <span>
        {sentence}
        {inside && (
          <button type="button" className={`${style.into} finger`} onClick={show}>
            Show it inside
          </button>
        )}
      </span>
    </li>
  );
}

/** Says so, too, when nothing is recorded that would explain it. */
export function FailureCauses({ runner, run, onShow }: Props) {
  const found = useCauses(runner, run).data;
  if (!needsExplanation(run) || found === undefined) return null;
  const places = placesOf(run);
  const operator = found[0]?.kind.startsWith("operator_") ?? false;
  const Icon = operator ? IconHandStop : IconAlertTriangle;
  const plain = run.ended_at === null || run.state === "stopped" || run.result === null;
  if (found.length === 0 && plain) return null;
  return (
    <section
      className={style.causes}
      aria-label="Why"
      data-known={found.length > 0 || undefined}
      data-operator={operator || undefined}
    >
      <h2>
        <Icon size={15} aria-hidden /> Why
      </h2>
      {found.length === 0 ? (
        <p>No cause is recorded.</p>
      ) : (
        <ol>
          {found.slice(0, SHOWN).map((cause) => (
            <Line
              key={`${cause.kind} ${cause.at} ${cause.text}`}
              cause={cause}
              inside={(places.get(cause.action ?? "")?.levels.length ?? 0) > 0}
              onShow={onShow}
            />
          ))}
        </ol>
      )}
      {found.length > SHOWN && <p>and {found.length - SHOWN} more, among the events</p>}
      <SinceWhenButton runner={runner} run={run} />
    </section>
  );
}

type CourseChange = SinceWhen["partings"][number];

interface SinceWhenButtonProps {
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
        : from this edit on, the graph goes {place.parts ? "another way" : "the first way again"}.{" "}
        <Link to={`/graphs/${graph}?at=${place.seq}`}>The graph then</Link>
      </p>
      <DifferenceView
        found={{ actions: [], relations: [], ...changes }}
        label={`What ${isolated(authorName(place.author))} changed`}
      />
      <p className={style.step}>
        Step {place.place}: <del className="ink2">{place.before}</del>{" "}
        <ins className="weight-600 no-underline">{place.after}</ins>
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
      <p className="ink2 text-13">
        {found.looked} {found.looked === 1 ? "moment" : "moments"} {since}, simulated with what the
        actions of this run did.
        {found.exact ? "" : " The graph may have changed and changed back between two of them."}
      </p>
    </>
  );
}

function SinceWhenButton({ runner, run }: SinceWhenButtonProps) {
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
          <p role="status" className="row gap-50">
            <Loader size="xs" /> Past moments of the graph are simulated…
          </p>
        )}
        {asked.isError && <p role="alert">{errorText(asked.error)}</p>}
        {asked.data !== undefined && <Answer answer={asked.data} graph={run.graph} />}
      </Modal>
    </>
  );
}
