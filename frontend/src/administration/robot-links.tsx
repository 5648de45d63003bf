/** Robots, and when each of them last answered. */
import { ago, instant } from "../ui/times";
import style from "./administration.module.css";
import type { ProcessStatus } from "./status";

export function RobotLinks({ status }: { status: ProcessStatus }) {
  const { robots } = status.activity;
  if (robots === undefined || robots.length === 0) return null;
  const now = Date.parse(status.at);
  return (
    <section className={style.card} aria-label="Links to robots">
      <div className={style.cardHead}>
        <h3>Links to robots</h3>
      </div>
      {/* biome-ignore lint/a11y/noNoninteractiveTabindex: what scrolls is reached by keys */}
      <div className={style.scroll} tabIndex={0}>
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
