/** Of which moment of which run a dry-run begins, with its values, and what of it is not known. */
import { Button, Popover } from "@mantine/core";
import { IconHistory } from "@tabler/icons-react";
import type { SeedDoubt } from "../../dry-run/seed";
import type { DryRun } from "../../dry-run/use-dry-run";
import { stopwatch } from "../../ui/times";
import style from "./dry-run-bar.module.css";

const MOST = 12; // lines of each list

function Doubt({ doubt: { node, text } }: { doubt: SeedDoubt }) {
  return (
    <li>
      {node !== "" && <b>{node}</b>} {text}.
    </li>
  );
}

export function SeedNote({ run }: { run: DryRun }) {
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
          It begins as run {seed.number} was {stopwatch(seed.at)} after its start. What went on then
          waits for you: decide how it ends.
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
            <h3>Not known, or not as it was</h3>
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

/** How what is decided next ended in the run. */
export function SeedEnd({ run, node }: { run: DryRun; node: string }) {
  const { seed } = run;
  const end = seed?.ends.get(node);
  if (!seed || end === undefined) return null;
  return (
    <span className={style.how}>
      (in run {seed.number}: <b>{end}</b>)
    </span>
  );
}
