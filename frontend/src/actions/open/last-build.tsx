/** How the last build of an action's package went: its errors with file and line, or that it was built. */
import { type ActionBuild, useLastBuild } from "../../api/documents/library";
import { ago, instant, useNow } from "../../ui/times";
import style from "./open.module.css";

type BuildFault = ActionBuild["errors"][number];

/** `src/open_gripper.cpp:25:5`; nothing where no file was named. */
export function faultPlace({ file, line, column }: BuildFault): string {
  return [file, line, column].filter((part) => part !== null && part !== "").join(":");
}

/** What came of it, in a few words. */
export function buildWords({ ended_well, errors }: ActionBuild): string {
  if (ended_well) return "built";
  if (errors.length === 0) return "not built, for errors of others in its package";
  return errors.length === 1 ? "1 error" : `${errors.length} errors`;
}

export function LastBuild({ id }: { id: string }) {
  const { data } = useLastBuild(id);
  const now = useNow(20_000);
  const build = data?.build;
  if (!build) return null;
  const at = instant(build.at);
  return (
    <section
      aria-label="Last build"
      className={style.build}
      data-failed={!build.ended_well || undefined}
    >
      <p>
        <b>Last build</b> {buildWords(build)}
        {at !== null && <time dateTime={build.at}>{ago(at, now)}</time>}
      </p>
      {build.errors.length > 0 && (
        <ul>
          {build.errors.map((fault) => (
            <li key={`${faultPlace(fault)} ${fault.message}`}>
              <code>{faultPlace(fault)}</code> {fault.message}
            </li>
          ))}
        </ul>
      )}
    </section>
  );
}
