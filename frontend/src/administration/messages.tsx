/** Receivers of messages by webhook and mail, as both processes send to them: for owners. */
import { Button, Text } from "@mantine/core";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { renewing, runnerAt } from "../api/client";
import { errorText } from "../api/http";
import type { EditorApi } from "../api/schema/editor";
import { serverNow } from "../clock/server-clock";
import { ago, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./administration.module.css";
import { Facts, type StatusFact } from "./process-card";

type ReceiverState = EditorApi["ReceiverState"];

const EACH_MS = 10_000;
const WAYS = { webhook: "Webhook", mail: "Mail" } as const;

/** Return the key of the receivers of a process. `at`: where it answers, "" for the editor. */
const keyOf = (at: string | undefined) => ["receivers", at] as const;

function useReceivers(at: string | undefined) {
  return useQuery({
    queryKey: keyOf(at),
    queryFn: ({ signal }) => runnerAt(at).get("/api/notifications", { signal, timeoutMs: 6_000 }),
    enabled: at !== undefined,
    refetchInterval: EACH_MS,
    retry: false,
  });
}

function factsOf(receiver: ReceiverState, now: number): StatusFact[] {
  const { to, kinds, off, sent_at, tried_at, error, waiting, failed } = receiver;
  const [sent, tried] = [instant(sent_at), instant(tried_at)];
  const facts: StatusFact[] = [
    { name: "To", value: to },
    { name: "Kinds", value: kinds.join(", ") },
    { name: "Last delivery", value: sent === null ? "none" : ago(sent, now) },
  ];
  if (off) facts.push({ name: "Off", value: off, isBad: true });
  else if (error) {
    const when = tried === null ? "" : `, ${ago(tried, now)}`;
    facts.push({ name: "Last failure", value: `${error.replace(/\.$/, "")}${when}`, isBad: true });
  }
  if (waiting > 0) facts.push({ name: "Tried again", value: `${waiting} messages`, isBad: true });
  if (failed > 0) facts.push({ name: "Given up", value: `${failed} in the last 30 days` });
  return facts;
}

interface ReceiverProps {
  receiver: ReceiverState;
  at: string | undefined;
  process: string;
}

function Receiver({ receiver, at, process }: ReceiverProps) {
  const client = useQueryClient();
  const { name, way, off } = receiver;
  const test = useMutation({
    mutationFn: () =>
      runnerAt(at).post("/api/notifications/{name}/test", { path: { name }, timeoutMs: 60_000 }),
    onSettled: renewing(() => client.invalidateQueries({ queryKey: keyOf(at) })),
  });
  const outcome = test.data && (test.data.error ? "It did not arrive." : "It has arrived.");
  return (
    <div className="stack gap-50">
      <div className={style.cardHead}>
        <h4 className="m-0">
          {WAYS[way]} {isolated(name)}
        </h4>
        <span className="m-0 ink2 text-13">of the {process}</span>
        {off && (
          <span className={style.state} data-state="lacking">
            Off
          </span>
        )}
      </div>
      <Facts facts={factsOf(receiver, serverNow())} />
      <div className="flex gap-50 items-center">
        <Button
          size="compact-sm"
          variant="default"
          loading={test.isPending}
          aria-label={`Send a test to ${isolated(name)}, by the ${process}`}
          onClick={() => test.mutate()}
        >
          Send a test
        </Button>
        <Text size="sm" role="status">
          {test.error ? errorText(test.error) : outcome}
        </Text>
      </div>
    </div>
  );
}

/** Shows all receivers. Without any it says how they are set. `runner`: where the runner answers. */
export function MessagesCard({ runner }: { runner: string | undefined }) {
  const asked = [
    { process: "editor", at: "", query: useReceivers("") },
    { process: "runner", at: runner, query: useReceivers(runner) },
  ];
  const errors = asked.filter(({ query }) => query.error !== null);
  const isKnown = asked.every(({ query }) => query.data !== undefined);
  const count = asked.reduce((all, { query }) => all + (query.data?.length ?? 0), 0);
  return (
    <section className="page-card min-w-0" aria-label="Messages">
      <div className={style.cardHead}>
        <h3>Messages</h3>
      </div>
      {errors.map(({ process, query }) => (
        <p key={process} className={style.refused} role="alert">
          The {process}: {errorText(query.error)}
        </p>
      ))}
      {isKnown && count === 0 && (
        <p className="m-0 ink2 text-13">
          No receiver is set up, so no message is sent by mail or webhook.{" "}
          <code>ACTION_ASSISTANT_NOTIFICATIONS</code> names a file with receivers; the
          administrator’s guide in <i>Help</i> says how.
        </p>
      )}
      <div className="stack gap-75">
        {asked.flatMap(({ process, at, query }) =>
          (query.data ?? []).map((receiver) => (
            <Receiver
              key={`${process}/${receiver.name}`}
              receiver={receiver}
              at={at}
              process={process}
            />
          )),
        )}
      </div>
    </section>
  );
}
