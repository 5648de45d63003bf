/** A second person's yes to a start: who has said it, and a way to say it and to ask for it. */
import { Button, Text } from "@mantine/core";
import { IconSend, IconUserCheck } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { renewing } from "../../api/client";
import { errorText } from "../../api/http";
import { useLive } from "../../api/page-link";
import { useMay, usePerson } from "../../api/people";
import type { Preflight } from "../../api/robots";
import {
  type Approval,
  type ApprovalWanted,
  approve,
  askApproval,
  fetchApprovals,
  type StartValues,
} from "../../api/starts";
import { isolated } from "../../words/isolated";
import style from "./start-dialog.module.css";

interface SecondPersonProps {
  graph: string;
  label: string;
  looks: readonly Preflight[] | undefined;
  /** Values of the start; they are part of what is said yes to. */
  values: StartValues;
  /** The question whose values these are. */
  taken: ApprovalWanted | null;
}

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

export function SecondPerson({ graph, label, looks, values, taken }: SecondPersonProps) {
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
  const isMissing = given.data?.every(({ author }) => author.id === person.id) ?? false;
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
      {may && !mine && (
        <Button
          size="compact-sm"
          loading={say.isPending}
          leftSection={<IconUserCheck size={14} aria-hidden />}
          onClick={() => say.mutate()}
        >
          Say yes to {isolated(label)}, for somebody else to start it
        </Button>
      )}
      {may && isMissing && (
        <Button
          size="compact-sm"
          variant="default"
          loading={ask.isPending}
          disabled={ask.isSuccess}
          leftSection={<IconSend size={14} aria-hidden />}
          onClick={() => ask.mutate()}
        >
          Ask others for their yes
        </Button>
      )}
      {ask.isSuccess && (
        <Text size="sm" role="status">
          {ask.data > 0
            ? "Others are asked by mail or webhook."
            : "No receiver of such messages is set here: ask somebody yourself. They see it where they start the graph."}
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
