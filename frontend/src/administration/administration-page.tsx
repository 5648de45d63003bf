/** The installation, for whoever looks after it: both processes, what they take, what is wrong. */
import { IconServerCog } from "@tabler/icons-react";
import { useLive } from "../api/live/use-live";
import { useMay } from "../api/use-person";
import { Empty } from "../ui/empty";
import style from "./administration.module.css";
import { BackupsCard } from "./backups-card";
import { Findings } from "./findings";
import { ProcessCard } from "./process-card";
import { RobotLinks } from "./robot-links";
import { useStatus } from "./status";

function Inside() {
  const { runner } = useLive();
  const ofEditor = useStatus("editor", "");
  const ofRunner = useStatus("runner", runner);
  return (
    <>
      <div className={style.processes}>
        <ProcessCard title="Editor" asked={ofEditor} />
        <ProcessCard title="Runner" asked={ofRunner} />
      </div>
      {ofRunner.data && <RobotLinks status={ofRunner.data} />}
      {ofEditor.data && (
        <BackupsCard backups={ofEditor.data.backups ?? null} at={ofEditor.data.at} />
      )}
      <Findings />
    </>
  );
}

export function AdministrationPage() {
  const may = useMay("restore");
  return (
    <main className={style.page}>
      <div className={style.inner}>
        <h2 className={style.title}>Administration</h2>
        {may ? (
          <Inside />
        ) : (
          <Empty icon={<IconServerCog size={22} />} title="For owners only">
            Who has the token of this server sees here how its processes are.
          </Empty>
        )}
      </div>
    </main>
  );
}
