/** A second person's yes to a start: what exactly they say yes to, who has said it, and the question to others. */
import { Button, Text } from "@mantine/core";
import { IconSend, IconUserCheck } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { renewing } from "../api/client";
import { publish, useVersions, versionName } from "../api/graphs";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay, usePerson } from "../api/people";
import type { Preflight } from "../api/robots";
import {
  type Approval,
  type ApprovalWanted,
  approve,
  askApproval,
  fetchApprovals,
  fetchWantedApprovals,
  type StartValues,
} from "../api/starts";
import { isolated } from "../words/isolated";
import style from "./second-person.module.css";
import { SilentSites } from "./silent-sites";

interface SecondPersonProps {
  graph: string;
  /** The moment of a graph that may be no version yet: it becomes one when others are asked for their yes. */
  seq?: number;
  label: string;
  looks: readonly Preflight[] | undefined;
  /** Values of the start; they are part of what is said yes to. */
  values: StartValues;
  /** The question whose values these are. */
  taken: ApprovalWanted | null;
  /** Set while the start is another one than its person has looked at: nobody says yes to that unseen. */
  changed?: boolean;
}

const YES_AGAIN = 5_000; // ms

/** Return whether nobody else has said yes. */
const isMissing = (given: readonly Approval[], me: string): boolean =>
  given.every(({ author }) => author.id === me);

/** A whole order to which somebody has to say yes, and the robots that ask for it. */
interface Demand {
  readonly digest: string;
  readonly order: Preflight["order"];
  readonly robots: readonly string[];
}

/** Return the orders to which a second person has to say yes: robots may have limits of their own. */
export function demandsIn(looks: readonly Preflight[] | undefined): Demand[] {
  const found = new Map<string, Demand>();
  for (const { engine, items, order = [], order_digest: digest = "" } of looks ?? []) {
    if (digest === "" || items.every(({ code }) => code !== "approved")) continue;
    const known = found.get(digest);
    found.set(digest, { digest, order, robots: [...(known?.robots ?? []), engine] });
  }
  return [...found.values()];
}

/** Lists an order in the words of the runner. */
function OrderWords({ order }: { order: Preflight["order"] }) {
  const lines = order ?? [];
  return (
    <dl className={style.order} aria-label="What exactly is said yes to">
      {lines.map(({ what, text }) => (
        <div key={`${what} ${text}`}>
          <dt>{what}</dt>
          <dd>{isolated(text)}</dd>
        </div>
      ))}
    </dl>
  );
}

/** Query who has said yes to an order; again and again while nobody but this person has. */
function useApprovals(digest: string) {
  const { runner = "" } = useLive();
  const { person } = usePerson();
  return useQuery({
    queryKey: ["approvals", digest],
    queryFn: ({ signal }) => fetchApprovals(runner, digest, signal),
    // Whoever waits for a yes sees it when it comes.
    refetchInterval: ({ state }) => (isMissing(state.data ?? [], person.id) ? YES_AGAIN : false),
  });
}

/** Say yes to an order. */
function useYes(digest: string, graph: string, label: string) {
  const { runner = "" } = useLive();
  const client = useQueryClient();
  return useMutation({
    mutationFn: () => approve(runner, { digest, graph, version: label, note: "" }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: ["approvals", digest] })),
  });
}

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

/** Asks for the yes of a second person to each order of a start that needs one. */
export function SecondPerson(props: SecondPersonProps) {
  return demandsIn(props.looks).map((demand) => (
    <OneOrder key={demand.digest} {...props} demand={demand} />
  ));
}

function OneOrder(props: SecondPersonProps & { demand: Demand }) {
  const { graph, seq, label, values, taken, changed = false, demand } = props;
  const { digest, robots } = demand;
  const { runner = "" } = useLive();
  const { person } = usePerson();
  const may = useMay("operate");
  const given = useApprovals(digest);
  const say = useYes(digest, graph, label);
  const ask = useMutation({
    mutationFn: async () => {
      // Others say yes to versions alone.
      if (seq !== undefined) await publish(graph, seq);
      return askApproval(runner, { digest, robots: [...robots], graph, version: label, values });
    },
  });
  const lacks = given.data !== undefined && isMissing(given.data, person.id);
  const mine = given.data?.some(({ author }) => author.id === person.id) ?? true;
  return (
    <section className={style.second} aria-label="A second person">
      <Said given={given.data ?? []} me={person.id} label={label} />
      <SilentSites route="get /api/approvals" missing="who said yes there is not known" />
      <OrderWords order={demand.order} />
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

interface WantedProps {
  graph: string;
  /** The look before the start that this page shows: what it asks for itself is not listed twice. */
  looks: readonly Preflight[] | undefined;
}

/** Lists for which starts of a graph others ask for a yes, each in the words of the runner. Nothing while nobody asks. */
export function WantedYes({ graph, looks }: WantedProps) {
  const { runner } = useLive();
  const { person } = usePerson();
  const may = useMay("operate");
  const wanted = useQuery({
    queryKey: ["approvals", "asked", graph],
    queryFn: ({ signal }) => fetchWantedApprovals(runner ?? "", graph, signal),
    enabled: runner !== undefined && may,
    staleTime: 0,
    gcTime: 0,
  });
  const own = new Set(demandsIn(looks).map(({ digest }) => digest));
  const others = (wanted.data ?? []).filter(
    ({ author, digest }) => author.id !== person.id && !own.has(digest),
  );
  const each = [...new Map(others.map((question) => [questionKey(question), question])).values()];
  return (
    <>
      <SilentSites
        route="get /api/approvals/asked"
        missing="who asks for a yes there is not known"
      />
      {each.map((question) =>
        question.hidden ? (
          <HiddenQuestion key={questionKey(question)} question={question} why={question.hidden} />
        ) : (
          <Wanted key={question.digest} graph={graph} question={question} me={person.id} />
        ),
      )}
    </>
  );
}

/** Return the order of a question; of one with a graph out of sight nothing but who asks, and when, is known. */
const questionKey = ({ digest, author, at }: ApprovalWanted): string =>
  digest === "" ? `${author.id} ${at}` : digest;

/** Says that somebody asks for a yes that this person cannot give, and why. */
function HiddenQuestion({ question, why }: { question: ApprovalWanted; why: string }) {
  const { author, robots } = question;
  const who = author.name || "Somebody";
  return (
    <section className={style.second} aria-label={`${isolated(who)} asks for a second person`}>
      <Text size="sm">
        {isolated(who)} asks others for their yes, for {robots.map(isolated).join(", ")}. {why}
      </Text>
    </section>
  );
}

function Wanted(props: { graph: string; question: ApprovalWanted; me: string }) {
  const { graph, question, me } = props;
  const { digest, author, robots, order, tree_digest: tree } = question;
  const versions = useVersions(graph).data ?? [];
  const version = versions.find((each) => (each.tree_digest ?? each.digest) === tree);
  const label = version ? versionName(versions, version.id) : "";
  const given = useApprovals(digest).data;
  const say = useYes(digest, graph, label);
  const mine = given?.some((each) => each.author.id === me) ?? true;
  const isAnswered = given?.some((each) => each.author.id !== author.id);
  if (isAnswered && !mine) return null;
  const who = author.name || "Somebody";
  return (
    <section className={style.second} aria-label={`${isolated(who)} asks for a second person`}>
      <Text size="sm">
        {isolated(who)} asks others for their yes, for {robots.map(isolated).join(", ")}:{" "}
        {label === "" ? "a graph that is no version here" : isolated(label)}.
      </Text>
      <OrderWords order={order} />
      {order.length === 0 && (
        <Text size="sm" c="var(--warn)">
          What exactly is asked is not known in words: look at the same start yourself.
        </Text>
      )}
      {mine ? (
        given && <Text size="sm">You said yes to exactly this.</Text>
      ) : (
        <Button
          size="compact-sm"
          disabled={order.length === 0 || label === ""}
          loading={say.isPending}
          leftSection={<IconUserCheck size={14} aria-hidden />}
          onClick={() => say.mutate()}
        >
          Say yes to exactly this, for {isolated(who)} to start it
        </Button>
      )}
      {say.error !== null && (
        <Text size="sm" c="var(--error)" role="alert">
          {errorText(say.error)}
        </Text>
      )}
    </section>
  );
}
