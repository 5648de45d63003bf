/** The buttons beside a look before a start for what it lacks: the baton, a second person's yes, a confirmation. */
import { Button, Text } from "@mantine/core";
import { IconSend, IconUserCheck } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { renewing } from "../api/client";
import { errorText, unconfirmed } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay, usePerson } from "../api/people";
import { useRight } from "../api/rights";
import type { Preflight } from "../api/robots";
import {
  type Approval,
  type ApprovalWanted,
  approve,
  askApproval,
  fetchApprovals,
  type StartValues,
} from "../api/starts";
import { isolated } from "../words/isolated";
import { TakeBaton } from "./robot-rights";
import style from "./start-remedies.module.css";

interface SecondPersonProps {
  graph: string;
  label: string;
  looks: readonly Preflight[] | undefined;
  /** Values of the start; they are part of what is said yes to. */
  values: StartValues;
  /** The question whose values these are. */
  taken: ApprovalWanted | null;
  /** Set while the start is another one than its person has looked at: nobody says yes to that unseen. */
  changed?: boolean;
}

/** Return the robots that ask this person to confirm who they are. */
export function askingRobots(looks: readonly Preflight[] | undefined): string[] {
  const asks = ({ items }: Preflight) =>
    items.some(({ code, verdict }) => code === "confirm" && verdict === "blocked");
  return (looks ?? []).filter(asks).map(({ engine }) => engine);
}

/** Offers to confirm who one is, before anything is held; whatever shows it stays as it is. */
export function ConfirmFirst({ looks }: { looks: readonly Preflight[] | undefined }) {
  const robots = askingRobots(looks);
  if (robots.length === 0) return null;
  return (
    <section className={style.second} aria-label="Confirm that it is you">
      <Button
        size="compact-sm"
        leftSection={<IconUserCheck size={14} aria-hidden />}
        onClick={() => unconfirmed.set(robots)}
      >
        Confirm that it is you …
      </Button>
    </section>
  );
}

/** Offers the baton of a robot that it would need. */
export function BatonRemedy({ engine, onTaken }: { engine: string; onTaken: () => void }) {
  const { now } = useLive();
  const robot = now.engines.find(({ name }) => name === engine);
  const mayTake = useRight(engine)?.may_take ?? false;
  if (robot === undefined || !mayTake) return null;
  return (
    <span className={style.remedies}>
      <TakeBaton robot={robot} onTaken={onTaken} />
    </span>
  );
}

const YES_AGAIN = 5_000; // ms

/** Return whether nobody else has said yes. */
const isMissing = (given: readonly Approval[], me: string): boolean =>
  given.every(({ author }) => author.id === me);

const demands = (looks: SecondPersonProps["looks"]) =>
  looks?.find(({ items }) => items.some(({ code }) => code === "approved"));

function Said({ given, me, label }: { given: readonly Approval[]; me: string; label: string }) {
  const others = given.filter(({ author }) => author.id !== me);
  const mine = others.length < given.length;
  return (
    <Text size="sm">
      {others.length > 0 && (
        <>
          Said yes to {isolated(label)}:{" "}
          <bdi>{others.map(({ author }) => isolated(author.name)).join(", ")}</bdi>.{" "}
        </>
      )}
      {mine && `You said yes to ${isolated(label)}: somebody else may start it.`}{" "}
      <span className="ink2">
        A second person needs a browser of their own. Two browsers that opened the same link may
        belong to one person: the server cannot know that.
      </span>
    </Text>
  );
}

export function SecondPerson(props: SecondPersonProps) {
  const { graph, label, looks, values, taken, changed = false } = props;
  const { runner = "" } = useLive();
  const { person } = usePerson();
  const may = useMay("operate");
  const client = useQueryClient();
  const digest = demands(looks)?.order_digest ?? "";
  const key = ["approvals", digest];
  const given = useQuery({
    queryKey: key,
    queryFn: ({ signal }) => fetchApprovals(runner, digest, signal),
    enabled: digest !== "",
    // Whoever waits for a yes sees it when it comes.
    refetchInterval: ({ state }) => (isMissing(state.data ?? [], person.id) ? YES_AGAIN : false),
  });
  const say = useMutation({
    mutationFn: () => approve(runner, { digest, graph, version: label, note: "" }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: key })),
  });
  const robots = (looks ?? [])
    .filter(({ items }) => items.some(({ code }) => code === "approved"))
    .map(({ engine }) => engine);
  const ask = useMutation({
    mutationFn: () => askApproval(runner, { digest, robots, graph, version: label, values }),
  });
  if (digest === "") return null;
  const lacks = given.data !== undefined && isMissing(given.data, person.id);
  const mine = given.data?.some(({ author }) => author.id === person.id) ?? true;
  return (
    <section className={style.second} aria-label="A second person">
      <Said given={given.data ?? []} me={person.id} label={label} />
      {taken !== null && (
        <Text size="sm" c={taken.digest === digest ? "var(--ink)" : "var(--warn)"}>
          {taken.digest === digest ? "Exactly the start" : "NOT exactly the start"} for which{" "}
          <bdi>{taken.author.name || "somebody"}</bdi> asks
          {taken.digest === digest
            ? "."
            : ": the graph, its robots, where it begins, or what is started in spite of a check differ."}
        </Text>
      )}
      {changed && (
        <Text size="sm" c="var(--warn)" role="status">
          Something has changed: look again before you say yes.
        </Text>
      )}
      {may && !mine && (
        <Button
          size="compact-sm"
          disabled={changed}
          loading={say.isPending}
          leftSection={<IconUserCheck size={14} aria-hidden />}
          onClick={() => say.mutate()}
        >
          Say yes to {isolated(label)}, for somebody else to start it
        </Button>
      )}
      {may && lacks && (
        <Button
          size="compact-sm"
          variant="default"
          loading={ask.isPending}
          disabled={changed || ask.isSuccess}
          leftSection={<IconSend size={14} aria-hidden />}
          onClick={() => ask.mutate()}
        >
          Ask others for their yes
        </Button>
      )}
      {lacks && ask.isSuccess && (
        <Text size="sm" role="status">
          {ask.data > 0
            ? "Others are asked by mail or webhook."
            : "No receiver of such messages is set here: ask somebody yourself. They see it where they start the graph, or in the queue."}
        </Text>
      )}
      {[say.error, ask.error].map(
        (error) =>
          error !== null && (
            <Text key={error.message} size="sm" c="var(--error)" role="alert">
              {errorText(error)}
            </Text>
          ),
      )}
    </section>
  );
}
