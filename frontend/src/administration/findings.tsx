/** Findings of `action-assistant doctor` on this computer, when a person asks for them. */
import { Button, Loader } from "@mantine/core";
import { IconStethoscope } from "@tabler/icons-react";
import { errorText } from "../api/http";
import { useTick } from "../ui/times";
import style from "./administration.module.css";
import { type Finding, type LastExamination, span, useExamination } from "./status";

const SIGNS = {
  error: { sign: "✗", word: "Wrong" },
  warning: { sign: "·", word: "May matter" },
  fine: { sign: "✓", word: "Fine" },
} as const;

const ORDER = ["error", "warning", "fine"] as const;

function Found({ code, severity, where, message, remedy }: Finding) {
  const { sign, word } = SIGNS[severity];
  return (
    <li data-severity={severity}>
      <b className={style.sign} aria-hidden>
        {sign}
      </b>
      <div>
        <span className="visually-hidden">{word}: </span>
        <b>
          <bdi>{where}</bdi>
        </b>{" "}
        {message} {code && <code>{code}</code>}
        {remedy && <p>{remedy}</p>}
      </div>
    </li>
  );
}

/** Return a summary of the findings in a few words. */
function summary(found: readonly Finding[]): string {
  const wrong = found.filter(({ severity }) => severity === "error").length;
  const notes = found.filter(({ severity }) => severity === "warning").length;
  if (wrong + notes === 0) return "Nothing is wrong.";
  const said = wrong === 1 ? "1 thing is wrong" : `${wrong || "No"} things are wrong`;
  return notes === 0 ? `${said}.` : `${said}, ${notes} may matter.`;
}

function Looking({ last, seconds }: { last: LastExamination | undefined; seconds: number }) {
  const usual =
    last?.took_s == null ? "about ten" : `${Math.max(1, Math.round(last.took_s))} last time`;
  return (
    <p className={style.looking} role="status">
      <Loader size="xs" /> Checking disks, databases, ports, the clock and ROS 2, for{" "}
      {Math.floor(seconds)} s. It takes {usual}.
    </p>
  );
}

export function Findings() {
  const { last, heardAt, error, look } = useExamination();
  const now = useTick();
  const found = last?.found;
  const running = last?.running_s ?? null;
  const sorted = ORDER.flatMap(
    (severity) => found?.filter((each) => each.severity === severity) ?? [],
  );
  return (
    <section className="page-card min-w-0" aria-label="Doctor">
      <div className={style.cardHead}>
        <h3>Doctor</h3>
        {found != null && last?.age_s != null && (
          <span className="m-0 ink2 text-13" role="status">
            {summary(found)} Looked at {span(last.age_s * 1000 + Math.max(0, now - heardAt))} ago.
          </span>
        )}
        <Button
          leftSection={<IconStethoscope size={16} aria-hidden />}
          onClick={() => look()}
          disabled={running !== null}
          ml="auto"
        >
          {found == null ? "Look for faults" : "Look again"}
        </Button>
      </div>
      {running !== null && <Looking last={last} seconds={running} />}
      {running === null && (error !== null || last?.failed != null) && (
        <p className={style.refused} role="alert">
          {error === null ? last?.failed : errorText(error)}
        </p>
      )}
      {found == null && running === null && !error && (
        <p className="m-0 ink2 text-13">
          Runs the checks of <code>action-assistant doctor</code> on the computer of the editor.
        </p>
      )}
      {found != null && (
        <ul className={style.findings}>
          {sorted.map((each) => (
            <Found key={`${each.code} ${each.where} ${each.message}`} {...each} />
          ))}
        </ul>
      )}
    </section>
  );
}
