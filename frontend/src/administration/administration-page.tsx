/** The installation, for whoever looks after it: both processes, what they take, what is wrong. */
import { IconServerCog } from "@tabler/icons-react";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import type { Site } from "../api/sites";
import { serverNow } from "../clock/server-clock";
import { Empty } from "../ui/empty";
import { ago, instant } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./administration.module.css";
import { Findings } from "./findings";
import { MessagesCard } from "./messages";
import { Facts, ProcessCard, type StatusFact } from "./process-card";
import { type Backups, bytes, type ProcessStatus, span, useStatus } from "./status";

const runnerTitle = (site: string | undefined) => (site ? `Runner of ${isolated(site)}` : "Runner");

function FurtherRunner({ site }: { site: Site }) {
  const asked = useStatus("runner", site.url);
  return (
    <>
      <FaultsCard processes={[asked.data]} />
      <div className={style.processes}>
        <ProcessCard title={runnerTitle(site.name)} asked={asked} />
      </div>
      {asked.data && <RobotLinks status={asked.data} />}
    </>
  );
}

function Inside() {
  const { runner, now } = useLive();
  const [first, ...others] = now.sites ?? [];
  const ofEditor = useStatus("editor", "");
  const ofRunner = useStatus("runner", runner);
  return (
    <>
      <FaultsCard processes={[ofEditor.data, ofRunner.data]} />
      <div className={style.processes}>
        <ProcessCard title="Editor" asked={ofEditor} />
        <ProcessCard title={runnerTitle(first?.site.name)} asked={ofRunner} />
      </div>
      {ofRunner.data && <RobotLinks status={ofRunner.data} />}
      {others.map(({ site }) => (
        <FurtherRunner key={site.url} site={site} />
      ))}
      {ofEditor.data && (
        <BackupsCard backups={ofEditor.data.backups ?? null} at={ofEditor.data.at} />
      )}
      <MessagesCard runner={runner} />
      <Findings />
    </>
  );
}

export function AdministrationPage() {
  const may = useMay("restore");
  return (
    <main className="page">
      <div className={style.inner}>
        <h2 className="page-title">Administration</h2>
        {may ? (
          <Inside />
        ) : (
          <Empty icon={<IconServerCog size={22} />} title="For owners only">
            Only a person who has the token of this server sees the state of its processes here.
          </Empty>
        )}
      </div>
    </main>
  );
}

function factsOf(backups: Backups, now: number): StatusFact[] {
  const { made_at, failed_why, missing, off_site, proven_at, unsound, next_at, keep } = backups;
  const [made, proven, next] = [instant(made_at), instant(proven_at), instant(next_at)];
  const facts: StatusFact[] = [
    { name: "The last one", value: made === null ? "none was made" : ago(made, now), isBad: !made },
  ];
  if (backups.bytes != null && backups.seconds != null) {
    const took = span(1000 * backups.seconds);
    facts.push({ name: "Its size", value: `${bytes(backups.bytes)}, made in ${took}` });
  }
  for (const what of missing ?? []) facts.push({ name: "It lacks", value: what, isBad: true });
  if (off_site) facts.push({ name: "Off-site", value: off_site, isBad: true });
  if (failed_why) facts.push({ name: "Failed since", value: failed_why, isBad: true });
  facts.push({ name: "Last tried", value: proven === null ? "never" : ago(proven, now) });
  if (unsound) facts.push({ name: "The last trial", value: unsound, isBad: true });
  const due = next === null ? "no backup is scheduled" : span(next - now);
  facts.push({ name: "The next one", value: next === null ? due : `in ${due}` });
  if (keep) facts.push({ name: "Kept", value: keep });
  return facts;
}

export function BackupsCard({ backups, at }: { backups: Backups | null; at: string }) {
  return (
    <section className="page-card min-w-0" aria-label="Backups">
      <div className={style.cardHead}>
        <h3>Backups</h3>
        {backups?.is_late && (
          <span className={style.state} data-state="lacking">
            Late
          </span>
        )}
      </div>
      {backups === null ? (
        <p className="m-0 ink2 text-13">The state of the backups cannot be read.</p>
      ) : (
        <Facts facts={factsOf(backups, Date.parse(at))} />
      )}
    </section>
  );
}

/** Lists what a person has to mend, as either process has found it. Each names the other's faults, too. */
function FaultsCard({ processes }: { processes: readonly (ProcessStatus | undefined)[] }) {
  const faults = new Map(
    processes.flatMap((each) => each?.faults ?? []).map((fault) => [fault.what, fault]),
  );
  if (faults.size === 0) return null;
  return (
    <section className="page-card min-w-0" aria-label="To be mended">
      <div className={style.cardHead}>
        <h3>To be mended</h3>
      </div>
      <ul className={style.lacking}>
        {[...faults.values()].map(({ what, text, since }) => (
          <li key={what}>
            {text} <span className="ink2">Seen {ago(instant(since) ?? 0, serverNow())}.</span>
          </li>
        ))}
      </ul>
    </section>
  );
}

export function RobotLinks({ status }: { status: ProcessStatus }) {
  const { robots } = status.activity;
  if (robots === undefined || robots.length === 0) return null;
  const now = Date.parse(status.at);
  return (
    <section className="page-card min-w-0" aria-label="Links to robots">
      <div className={style.cardHead}>
        <h3>Links to robots</h3>
      </div>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls is reached by keys */}
      <div className="scroll-x" tabIndex={0}>
        <table className={style.figures}>
          <thead>
            <tr>
              <th>Robot</th>
              <th>State</th>
              <th>Last answer</th>
            </tr>
          </thead>
          <tbody>
            {robots.map(({ name, state, why, heard_at }) => {
              const heard = instant(heard_at);
              return (
                <tr key={name}>
                  <th>
                    <bdi>{name}</bdi>
                  </th>
                  <td title={why}>{state.replace("_", " ")}</td>
                  <td>{heard === null ? "never" : ago(heard, now)}</td>
                </tr>
              );
            })}
          </tbody>
        </table>
      </div>
    </section>
  );
}
