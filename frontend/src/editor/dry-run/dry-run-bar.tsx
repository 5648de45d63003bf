/** The bar of a dry-run: its moment, its controls, and the choice of how an action ends. */
import { ActionIcon, Button, Menu, Popover, Select } from "@mantine/core";
import {
  IconBolt,
  IconHistory,
  IconPlayerPauseFilled,
  IconPlayerPlayFilled,
  IconPlayerSkipBack,
  IconPlayerTrackNext,
  IconPlayerTrackPrev,
  IconX,
} from "@tabler/icons-react";
import type { ReactNode } from "react";
import { errorText } from "../../api/http";
import { OutcomeSign, outcomeColor, outcomeWord } from "../../canvas/outcome";
import { KeepDryRun } from "../../courses/keep-dry-run";
import type { RunningAction } from "../../dry-run/playback";
import { type DecidedFaultKind, faultWords } from "../../dry-run/script";
import type { SeedDoubt } from "../../dry-run/seed";
import { DRY_RUN_SPEEDS, type DryRun } from "../../dry-run/use-dry-run";
import * as editActions from "../../edit-actions/dry-run-actions";
import { type EditAction, labelOf } from "../../edit-actions/edit-action";
import { type EditorContext, selectedActions } from "../../edit-actions/editor-context";
import { FirstShortcut } from "../../edit-actions/keys/shortcuts";
import { fullName } from "../../graph/model";
import { endName } from "../../graph/relation-words";
import { spokenName } from "../../graph/spoken-name";
import { stopwatch } from "../../ui/times";
import { Tooltip } from "../../ui/tooltip";
import { isolated } from "../../words/isolated";
import style from "./dry-run-bar.module.css";
import { DryRunValues } from "./dry-run-values";

const MOST = 12; // lines of each list that are shown

function Doubt({ doubt: { node, text } }: { doubt: SeedDoubt }) {
  return (
    <li>
      {node !== "" && <b>{node}</b>} {text}.
    </li>
  );
}

/** Says which part of the graph is played. */
function PartNote({ run: { part } }: { run: DryRun }) {
  if (part === null) return null;
  const names = part.at.slice(0, 3).map((each) => isolated(spokenName(each)));
  const more = part.at.length > 3 ? ` and ${part.at.length - 3} more` : "";
  return (
    <span className="nowrap ink2 text-xs">
      {part.only ? "only" : "from"} {names.join(", ")}
      {more}; what is skipped counts as ended
    </span>
  );
}

function SeedNote({ run }: { run: DryRun }) {
  const { seed, doubts } = run;
  if (seed === null) return null;
  const unknown = doubts.length === 1 ? "1 thing not known" : `${doubts.length} things not known`;
  return (
    <Popover position="top-start" width={380} withinPortal>
      <Popover.Target>
        <Button
          size="compact-sm"
          variant="light"
          color={doubts.length > 0 ? "orange" : "blue"}
          leftSection={<IconHistory size={14} aria-hidden />}
        >
          From run {seed.number} at {stopwatch(seed.at)}
          {doubts.length > 0 && ` · ${unknown}`}
        </Button>
      </Popover.Target>
      <Popover.Dropdown className={style.seed ?? ""}>
        <p>
          The dry-run begins with the state of run {seed.number}, {stopwatch(seed.at)} after its
          start. Actions that ran at that moment wait for you: decide how they end.
        </p>
        {seed.values.length > 0 && (
          <dl aria-label="Values at that moment">
            {seed.values.slice(0, MOST).map(({ node, name, text }) => (
              <div key={`${node} ${name}`}>
                <dt>
                  {node} {name}
                </dt>
                <dd>{text}</dd>
              </div>
            ))}
          </dl>
        )}
        {doubts.length > 0 && (
          <>
            <h3>Not known, or different from the run</h3>
            <ul>
              {doubts.slice(0, MOST).map((doubt) => (
                <Doubt key={`${doubt.node} ${doubt.text}`} doubt={doubt} />
              ))}
              {doubts.length > MOST && <li>and {doubts.length - MOST} more</li>}
            </ul>
          </>
        )}
      </Popover.Dropdown>
    </Popover>
  );
}

/** Shows how this action ended in the run from which the dry-run started. */
function SeedEnd({ run, node }: { run: DryRun; node: string }) {
  const { seed } = run;
  const end = seed?.ends.get(node);
  if (!seed || end === undefined) return null;
  return (
    <span className={style.how}>
      (in run {seed.number}: <b>{end}</b>)
    </span>
  );
}

const CHOICES = ["on_true", "on_false", "on_error"] as const;

function Step({
  context,
  editAction,
  children,
}: {
  context: EditorContext;
  editAction: EditAction;
  children?: ReactNode;
}) {
  const Sign = editAction.icon;
  return (
    <Tooltip
      label={
        <>
          {labelOf(editAction, context)} <FirstShortcut editAction={editAction} />
        </>
      }
    >
      <ActionIcon
        size={34}
        aria-label={editAction.label}
        disabled={!editAction.enabled(context)}
        onClick={() => editAction.run(context)}
      >
        {children ?? <Sign size={17} aria-hidden />}
      </ActionIcon>
    </Tooltip>
  );
}

function time(ms: number): string {
  const seconds = ms / 1000;
  if (seconds < 100) return `${seconds.toFixed(1)} s`;
  const minutes = Math.floor(seconds / 60);
  return `${minutes}:${String(Math.floor(seconds % 60)).padStart(2, "0")} min`;
}

/** Return the running action whose end is to be chosen: the selected one, else the first. */
function askedAction(context: EditorContext, run: DryRun): RunningAction | undefined {
  return (
    run.sighting.running.find(({ key }) => context.selection.has(key)) ?? run.sighting.running[0]
  );
}

function Choices({ context, run }: { context: EditorContext; run: DryRun }) {
  const action = askedAction(context, run);
  if (!action) return null;
  const others = run.sighting.running.length > 1;
  return (
    // biome-ignore lint/a11y/useSemanticElements: a fieldset cannot be laid out as a row everywhere
    <div
      className={style.choices}
      role="group"
      aria-label={`How does ${isolated(endName(context.graph, action.key))} end?`}
    >
      {others ? (
        <Select
          size="xs"
          w={150}
          aria-label="Which running action"
          data={run.sighting.running.map(({ key }) => ({
            value: key,
            label: endName(context.graph, key),
          }))}
          value={action.key}
          onChange={(key) => key && context.select([key])}
        />
      ) : (
        <b>{endName(context.graph, action.key)}</b>
      )}
      <span className={style.how}>ends</span>
      {CHOICES.map((outcome, i) => (
        <Button
          key={outcome}
          size="compact-sm"
          className={style.choice ?? ""}
          disabled={run.busy}
          leftSection={<OutcomeSign outcome={outcome} />}
          rightSection={<span className="no-finger ink3 text-11 weight-500">{i + 1}</span>}
          style={{ color: outcomeColor[outcome] }}
          onClick={() => run.choose(outcome, action.key)}
        >
          {outcomeWord[outcome]}
        </Button>
      ))}
      <SeedEnd run={run} node={action.node} />
    </div>
  );
}

const OF_ACTIONS = [
  "error",
  "never",
  "exception",
  "deaf",
] as const satisfies readonly DecidedFaultKind[];

function Faults({ context, run }: { context: EditorContext; run: DryRun }) {
  const { fault } = run.decided;
  const [first] = selectedActions(context);
  const node = (first && fullName(first)) ?? askedAction(context, run)?.node;
  const at = run.moments[run.index]?.at ?? 0;
  const said =
    fault === null
      ? "Fault"
      : fault.kind === "stop"
        ? "Stop pressed"
        : `${fault.node}: ${faultWords[fault.kind]}`;
  return (
    <Menu position="top-end" width={260}>
      <Menu.Target>
        <Button
          size="compact-sm"
          variant={fault === null ? "subtle" : "light"}
          color={fault === null ? "gray" : "orange"}
          leftSection={<IconBolt size={14} aria-hidden />}
          className={style.fault ?? ""}
        >
          {said}
        </Button>
      </Menu.Target>
      <Menu.Dropdown>
        <Menu.Label>{node === undefined ? "Choose an action first" : node}</Menu.Label>
        {OF_ACTIONS.map((kind) => (
          <Menu.Item
            key={kind}
            disabled={node === undefined}
            onClick={() => node !== undefined && run.inject({ kind, node })}
          >
            {faultWords[kind]}
          </Menu.Item>
        ))}
        <Menu.Label>Somebody</Menu.Label>
        <Menu.Item onClick={() => run.inject({ kind: "stop", at })}>{faultWords.stop}</Menu.Item>
        {fault !== null && (
          <>
            <Menu.Divider />
            <Menu.Item onClick={() => run.inject(null)}>No fault</Menu.Item>
          </>
        )}
      </Menu.Dropdown>
    </Menu>
  );
}

function MomentText({ run }: { run: DryRun }) {
  if (run.failed) return <span className="ink-error">{errorText(run.failed)}</span>;
  if (run.moments.length === 0)
    return <span>{run.busy ? "Working it out …" : "Nothing happens."}</span>;
  const last = run.index === run.moments.length - 1;
  return (
    <>
      {run.words.join(" · ") || "…"}
      {last && run.cut && <i> · The graph continues, but the dry-run ends here.</i>}
      {last && !run.cut && run.sighting.running.length > 0 && (
        <i>
          {" "}
          ·{" "}
          {run.seed
            ? "Running actions wait for you: decide how they end."
            : "The running actions never end on their own."}
        </i>
      )}
    </>
  );
}

export function DryRunBar({
  context,
  run,
  record,
}: {
  context: EditorContext;
  run: DryRun;
  record: ReactNode;
}) {
  const at = run.moments[run.index]?.at ?? 0;
  return (
    <section className={style.bar} aria-label="Dry-run">
      <div className={style.row}>
        <span className={style.title}>Dry-run</span>
        <SeedNote run={run} />
        <PartNote run={run} />
        <DryRunValues key={run.seed?.run} graph={context.id} run={run} />
        <Step context={context} editAction={editActions.restart}>
          <IconPlayerSkipBack size={17} aria-hidden />
        </Step>
        <Step context={context} editAction={editActions.back}>
          <IconPlayerTrackPrev size={17} aria-hidden />
        </Step>
        <Step context={context} editAction={editActions.play}>
          {run.playing ? (
            <IconPlayerPauseFilled size={17} aria-hidden />
          ) : (
            <IconPlayerPlayFilled size={17} aria-hidden />
          )}
        </Step>
        <Step context={context} editAction={editActions.next}>
          <IconPlayerTrackNext size={17} aria-hidden />
        </Step>
        <input
          type="range"
          className={style.scrub}
          aria-label="Moment"
          aria-valuetext={`${time(at)}: ${run.words.join(", ")}`}
          min={0}
          max={Math.max(1, run.moments.length - 1)}
          value={run.index}
          disabled={run.moments.length === 0}
          onChange={(event) => {
            run.play(false);
            run.go(Number(event.currentTarget.value));
          }}
        />
        <span className={style.time}>{time(at)}</span>
        <Select
          size="xs"
          w={74}
          aria-label="Speed"
          className={style.speed ?? ""}
          data={DRY_RUN_SPEEDS.map((speed) => ({ value: String(speed), label: `${speed}×` }))}
          value={String(run.speed)}
          onChange={(speed) => run.setSpeed(Number(speed ?? 1))}
        />
        <Faults context={context} run={run} />
        <Tooltip
          label={
            <>
              Close <FirstShortcut editAction={editActions.dryRun} />
            </>
          }
        >
          <ActionIcon size={34} aria-label="Close the dry-run" onClick={run.close}>
            <IconX size={17} aria-hidden />
          </ActionIcon>
        </Tooltip>
      </div>
      <div className={style.row}>
        <p className={style.said} aria-live="polite">
          <MomentText run={run} />
        </p>
        <Choices context={context} run={run} />
      </div>
      <div className={style.note}>
        <span>Nothing of this is recorded.</span>
        {run.part === null && <KeepDryRun run={run} />}
        {run.part === null && record}
      </div>
    </section>
  );
}
