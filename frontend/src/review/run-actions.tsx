/** Buttons for a run: compare, export, run again, dry-run. */
import { Button, Menu } from "@mantine/core";
import {
  IconArrowsDiff,
  IconChartBar,
  IconDownload,
  IconFlask,
  IconLifebuoy,
  IconPrinter,
  IconRouteAltLeft,
} from "@tabler/icons-react";
import { useState } from "react";
import { Link } from "wouter";
import { useMay } from "../api/people";
import { exportUrl } from "../api/review";
import type { Run } from "../api/runs";
import { stopwatch } from "../ui/times";
import { IncidentDialog } from "./incident-dialog";
import { dryRunMoment, dryRunUrl } from "./replay";
import { type RepeatActions, RunMenu } from "./run-menu";
import style from "./run-page.module.css";

interface Props {
  runner: string | undefined;
  run: Run;
  /** Engines of the run, and of those that were started with it. */
  engines: readonly string[];
  onStart: (again: RepeatActions) => void;
}

const FORMATS = [
  ["jsonl", "Every event (JSON lines)"],
  ["csv", "Intervals (CSV)"],
  ["mcap", "For Foxglove (MCAP)"],
] as const;

interface LinkButtonProps {
  to: string;
  name: string;
  icon: typeof IconFlask;
  /** Its sign alone says enough. */
  small?: boolean;
}

/** On narrow screens its sign stays, and its name for those who hear it. */
function LinkButton({ to, name, icon: Icon, small = false }: LinkButtonProps) {
  return (
    <Button
      component={Link}
      to={to}
      variant="default"
      aria-label={name}
      title={name}
      leftSection={<Icon size={15} aria-hidden />}
      className={style.action ?? ""}
      data-small={small || undefined}
    >
      <span className={style.word}>{name}</span>
    </Button>
  );
}

function ExportButton({ runner, run }: Pick<Props, "runner" | "run">) {
  const [keeps, setKeeps] = useState(false);
  const mayKeep = useMay("share");
  return (
    <>
      <Menu position="bottom-end" withinPortal>
        <Menu.Target>
          <Button
            variant="default"
            aria-label="Export"
            title="Export"
            leftSection={<IconDownload size={15} aria-hidden />}
            className={style.action ?? ""}
          >
            <span className={style.word}>Export</span>
          </Button>
        </Menu.Target>
        <Menu.Dropdown>
          {FORMATS.map(([format, label]) => (
            <Menu.Item
              key={format}
              component="a"
              href={runner === undefined ? undefined : exportUrl(runner, run.id, format)}
              leftSection={<IconDownload size={15} aria-hidden />}
            >
              {label}
            </Menu.Item>
          ))}
          <Menu.Item
            leftSection={<IconPrinter size={15} aria-hidden />}
            onClick={() => setTimeout(() => window.print(), 0)}
          >
            Print it, or save it as PDF
          </Menu.Item>
          {mayKeep && (
            <Menu.Item
              leftSection={<IconLifebuoy size={15} aria-hidden />}
              onClick={() => setKeeps(true)}
            >
              Keep as an incident …
            </Menu.Item>
          )}
        </Menu.Dropdown>
      </Menu>
      {keeps && runner !== undefined && (
        <IncidentDialog runner={runner} run={run} onClose={() => setKeeps(false)} />
      )}
    </>
  );
}

/** Opens, from the replay, a dry-run that begins at its moment `at`. */
export function DryRunFromHere({ run, at }: Pick<Props, "run"> & { at: number | null }) {
  const moment = dryRunMoment(run, at);
  if (run.graph === null || moment === null) return null;
  return (
    <Button
      component={Link}
      to={dryRunUrl(run.graph, run.id, moment)}
      size="compact-xs"
      variant="light"
      flex="none"
      title="Opens a dry-run that begins as this run was at that moment"
      leftSection={<IconFlask size={14} aria-hidden />}
    >
      Dry-run from {stopwatch(moment)}
    </Button>
  );
}

export function RunActions({ runner, run, engines, onStart }: Props) {
  return (
    <>
      <LinkButton
        to={`/runs/compare?b=${encodeURIComponent(run.id)}`}
        name="Compare"
        icon={IconArrowsDiff}
      />
      <ExportButton runner={runner} run={run} />
      <RunMenu runner={runner} run={run} engines={engines} onStart={onStart} />
      {run.graph !== null && (
        <>
          <LinkButton
            to={`/runs/statistics?graph=${encodeURIComponent(run.graph)}`}
            name="Statistics"
            icon={IconChartBar}
            small
          />
          <LinkButton to={`/graphs/${run.graph}`} name="Open graph" icon={IconRouteAltLeft} small />
        </>
      )}
    </>
  );
}
