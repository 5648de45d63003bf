/** What `action-assistant doctor` finds here, when somebody asks for it. */
import { Button, Loader } from "@mantine/core";
import { IconStethoscope } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import { useNow } from "../ui/times";
import style from "./administration.module.css";
import { type Finding, useFindings } from "./status";

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

/** What there is of it, in a few words. */
function summary(found: readonly Finding[]): string {
  const wrong = found.filter(({ severity }) => severity === "error").length;
  const notes = found.filter(({ severity }) => severity === "warning").length;
  if (wrong + notes === 0) return "Nothing is wrong.";
  const said = wrong === 1 ? "1 thing is wrong" : `${wrong || "No"} things are wrong`;
  return notes === 0 ? `${said}.` : `${said}, ${notes} may matter.`;
}

function Looking() {
  const [began] = useState(() => Date.now());
  const seconds = Math.max(0, Math.floor((useNow() - began) / 1000));
  return (
    <p className={style.looking} role="status">
      <Loader size="xs" /> Looking at disks, databases, ports, the clock and ROS 2, for {seconds} s.
      It takes about ten.
    </p>
  );
}

export function Findings() {
  const { data, error, isFetching, refetch } = useFindings();
  const sorted = ORDER.flatMap(
    (severity) => data?.filter((each) => each.severity === severity) ?? [],
  );
  return (
    <section className={style.card} aria-label="Doctor">
      <div className={style.cardHead}>
        <h3>Doctor</h3>
        {data && !isFetching && (
          <span className={style.version} role="status">
            {summary(data)}
          </span>
        )}
        <Button
          leftSection={<IconStethoscope size={16} aria-hidden />}
          onClick={() => void refetch()}
          disabled={isFetching}
          ml="auto"
        >
          {data === undefined ? "Look for faults" : "Look again"}
        </Button>
      </div>
      {isFetching && <Looking />}
      {error && !isFetching && (
        <p className={style.refused} role="alert">
          {errorText(error)}
        </p>
      )}
      {data === undefined && !isFetching && !error && (
        <p className={style.version}>
          The same as <code>action-assistant doctor</code> on the computer of the editor.
        </p>
      )}
      {data !== undefined && (
        <ul className={style.findings}>
          {sorted.map((each) => (
            <Found key={`${each.code} ${each.where} ${each.message}`} {...each} />
          ))}
        </ul>
      )}
    </section>
  );
}
