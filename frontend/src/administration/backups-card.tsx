/** Backups: how old the last good one is, and what became of it. */
import { ago, instant } from "../ui/times";
import style from "./administration.module.css";
import { Facts, type StatusFact } from "./facts";
import { type Backups, bytes, span } from "./status";

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
  const due = next === null ? "nobody makes them by a timetable" : span(next - now);
  facts.push({ name: "The next one", value: next === null ? due : `in ${due}` });
  if (keep) facts.push({ name: "Kept", value: keep });
  return facts;
}

export function BackupsCard({ backups, at }: { backups: Backups | null; at: string }) {
  return (
    <section className={style.card} aria-label="Backups">
      <div className={style.cardHead}>
        <h3>Backups</h3>
        {backups?.is_late && (
          <span className={style.state} data-state="lacking">
            Late
          </span>
        )}
      </div>
      {backups === null ? (
        <p className={style.version}>What is known of them cannot be read.</p>
      ) : (
        <Facts facts={factsOf(backups, Date.parse(at))} />
      )}
    </section>
  );
}
