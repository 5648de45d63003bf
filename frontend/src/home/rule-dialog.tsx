/** An owner says who may see and who may edit a graph, or the graphs in a folder. */
import {
  Button,
  Group,
  Modal,
  MultiSelect,
  Radio,
  SegmentedControl,
  Stack,
  Text,
} from "@mantine/core";
import { useState } from "react";
import {
  type Rule,
  type Ruled,
  type RuleView,
  usePutRule,
  useRule,
  type Who,
} from "../api/graph-rights";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { useEntitled } from "../api/rights";
import { usePendingText } from "../ui/drafts";
import { isolated } from "../words/isolated";

type NameOf = (id: string) => string;

function listed(ids: readonly string[], nameOf: NameOf): string {
  const names = ids.map(nameOf);
  const last = names.pop() ?? "";
  return names.length === 0 ? last : `${names.join(", ")} and ${last}`;
}

/** Return a rule as sentences. `what`: "it", or the graphs in a folder as "them". */
export function ruleWords(rule: Rule, what: "it" | "them", nameOf: NameOf): string {
  const { readers, editors } = rule;
  const editing = editors === "all" || editors.length > 0;
  if (readers === "all") {
    if (editors === "all") return `Everybody may see and edit ${what}.`;
    const changers = editing ? listed(editors, nameOf) : "owners";
    return `Everybody may see ${what}. Only ${changers} may edit ${what}.`;
  }
  const named = editors === "all" ? readers : [...new Set([...readers, ...editors])];
  if (named.length === 0) return `Only owners may see ${what}.`;
  const viewers = listed(named, nameOf);
  if (editors === "all" || named.every((id) => editors.includes(id))) {
    return `Only ${viewers} may see and edit ${what}.`;
  }
  const changers = editing ? listed(editors, nameOf) : "owners";
  return `Only ${viewers} may see ${what}. Only ${changers} may edit ${what}.`;
}

interface ChoiceProps {
  question: string;
  /** The word for "all". */
  all: string;
  who: Who;
  nameOf: NameOf;
  onChange: (who: Who) => void;
}

/** Chooses everybody, or persons and groups. */
function Choice({ question, all, who, nameOf, onChange }: ChoiceProps) {
  const { groups, people } = useEntitled();
  // Kept while "everybody" is chosen, so that trying that out loses nobody.
  const [some, setSome] = useState<readonly string[]>(who === "all" ? [] : who);
  const items = (all: readonly { id: string }[]) =>
    all.map(({ id }) => ({ value: id, label: nameOf(id) }));
  const known = new Set([...groups, ...people].map(({ id }) => id));
  const removed = some.filter((id) => !known.has(id)).map((id) => ({ id }));
  return (
    <Stack gap={6}>
      <Text fw={550} size="sm" component="span">
        {question}
      </Text>
      <SegmentedControl
        fullWidth
        aria-label={question}
        value={who === "all" ? "all" : "some"}
        onChange={(value) => onChange(value === "all" ? "all" : [...some])}
        data={[
          { value: "all", label: all },
          { value: "some", label: "Only these" },
        ]}
      />
      {who !== "all" && (
        <MultiSelect
          aria-label={`${question}: persons and groups`}
          placeholder={who.length === 0 ? "Nobody but owners yet" : ""}
          searchable
          data={[
            { group: "Groups", items: items(groups) },
            { group: "People", items: items(people) },
            { group: "Removed", items: items(removed) },
          ]}
          value={[...who]}
          onChange={(ids) => {
            setSome(ids);
            onChange(ids);
          }}
        />
      )}
    </Stack>
  );
}

interface Props {
  ruled: Ruled;
  name: string;
  /** Set if a folder is around it, whose rule may count. */
  isInside: boolean;
  onClose: () => void;
}

function Form({ ruled, isInside, view, onClose }: Omit<Props, "name"> & { view: RuleView }) {
  const { groups, people } = useEntitled();
  const { runner } = useLive();
  const put = usePutRule(ruled, runner, onClose);
  const [inherits, setInherits] = useState(isInside && view.own === null);
  const [rule, setRule] = useState<Rule>(view.counts);
  const names = new Map([...groups, ...people].map(({ id, name }) => [id, name]));
  const nameOf = (id: string) => isolated(names.get(id) || "somebody who was removed");
  const what = ruled.kind === "graph" ? "it" : "them";
  const isOpen = rule.readers === "all" && rule.editors === "all";
  // Without a folder around it, a rule for everybody is no rule.
  const wanted = inherits || (isOpen && !isInside) ? null : rule;
  const changed = JSON.stringify(wanted) !== JSON.stringify(view.own);
  usePendingText(changed ? JSON.stringify(wanted) : "", null);
  // What failed may be stored at the editor alone: it can be saved again as it is.
  const canSave = changed || put.isError;
  return (
    <form
      onSubmit={(event) => {
        event.preventDefault();
        if (canSave && !put.isPending) put.mutate(wanted);
      }}
    >
      <Stack gap="md">
        {isInside && (
          <Radio.Group
            aria-label="Which rule counts"
            value={inherits ? "around" : "own"}
            onChange={(value) => setInherits(value === "around")}
          >
            <Stack gap="xs">
              <Radio
                value="around"
                label="As the folder around it says"
                description={ruleWords(view.around, what, nameOf)}
              />
              <Radio value="own" label="A rule of its own" />
            </Stack>
          </Radio.Group>
        )}
        {!inherits && (
          <>
            <Choice
              question={`Who may see ${what}`}
              all="Everybody"
              who={rule.readers}
              nameOf={nameOf}
              onChange={(readers) => setRule({ ...rule, readers })}
            />
            <Choice
              question={`Who may edit ${what}`}
              all={rule.readers === "all" ? "Everybody" : "All who may see"}
              who={rule.editors}
              nameOf={nameOf}
              onChange={(editors) => setRule({ ...rule, editors })}
            />
          </>
        )}
        {!inherits && (
          <Text size="sm" aria-live="polite">
            {ruleWords(rule, what, nameOf)}
          </Text>
        )}
        <Text size="sm" c="dimmed">
          Owners may always do both; editing takes a role that allows it, too. Others find no trace
          of {what} in lists, searches and other graphs. Of a run they see the robot, its state and
          who started it, and they can stop it.
        </Text>
        {put.isError && (
          <Text c="var(--error)" role="alert">
            {errorText(put.error)}
          </Text>
        )}
        <Group justify="flex-end">
          <Button onClick={onClose}>Cancel</Button>
          <Button type="submit" variant="filled" disabled={!canSave} loading={put.isPending}>
            Save
          </Button>
        </Group>
      </Stack>
    </form>
  );
}

function Loaded(props: Omit<Props, "name">) {
  const { data, error } = useRule(props.ruled);
  if (data) return <Form {...props} view={data} />;
  if (!error) return <Text aria-busy="true">Reading …</Text>;
  return (
    <Text c="var(--error)" role="alert">
      {errorText(error)}
    </Text>
  );
}

export function RuleDialog({ opened, name, ...props }: Props & { opened: boolean }) {
  const title =
    props.ruled.kind === "graph"
      ? `Who may see and edit ${isolated(name)}`
      : `Who may see and edit the graphs in ${isolated(name)}`;
  return (
    <Modal
      opened={opened}
      onClose={props.onClose}
      title={title}
      closeButtonProps={{ "aria-label": "Close" }}
      centered
    >
      <Loaded {...props} />
    </Modal>
  );
}
