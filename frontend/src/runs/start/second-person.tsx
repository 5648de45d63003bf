/** A yes to exactly what would be sent, where a chosen robot takes only what a second person has seen. */
import { Button, Text } from "@mantine/core";
import { IconUserCheck } from "@tabler/icons-react";
import { useMutation, useQuery, useQueryClient } from "@tanstack/react-query";
import { type Approval, approve, fetchApprovals } from "../../api/documents/starts";
import { errorText } from "../../api/http";
import { useLive } from "../../api/live/use-live";
import type { Preflight } from "../../api/robots";
import { useMay, usePerson } from "../../api/use-person";
import { isolated } from "../../words/isolated";
import style from "./start-dialog.module.css";

interface Props {
  graph: string;
  label: string;
  looks: readonly Preflight[] | undefined;
}

const demands = (looks: Props["looks"]) =>
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
      <span className={style.doubt}>
        A second person needs a browser of their own. One link that is opened in two browsers may be
        one person: that cannot be told here.
      </span>
    </Text>
  );
}

export function SecondPerson({ graph, label, looks }: Props) {
  const { runner = "" } = useLive();
  const { person } = usePerson();
  const may = useMay("operate");
  const client = useQueryClient();
  const digest = demands(looks)?.tree_digest ?? "";
  const key = ["approvals", digest];
  const given = useQuery({
    queryKey: key,
    queryFn: ({ signal }) => fetchApprovals(runner, digest, signal),
    enabled: digest !== "",
  });
  const say = useMutation({
    mutationFn: () => approve(runner, { digest, graph, version: label, note: "" }),
    onSettled: () => client.invalidateQueries({ queryKey: key }),
  });
  if (digest === "") return null;
  const mine = given.data?.some(({ author }) => author.id === person.id) ?? true;
  return (
    <section className={style.second} aria-label="A second person">
      <Said given={given.data ?? []} me={person.id} label={label} />
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
      {say.error !== null && (
        <Text size="sm" c="var(--error)" role="alert">
          {errorText(say.error)}
        </Text>
      )}
    </section>
  );
}
