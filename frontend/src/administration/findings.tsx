/** What `action-assistant doctor` finds here, when somebody asks for it. */
import { Alert, Button, Loader } from "@mantine/core";
import { IconAlertTriangle, IconCheck, IconInfoCircle, IconStethoscope } from "@tabler/icons-react";
import { useState } from "react";
import { errorText } from "../api/http";
import { useNow } from "../ui/times";
import style from "./administration.module.css";
import { type Finding, useFindings } from "./status";

const SIGNS = {
  wrong: { icon: IconAlertTriangle, word: "Wrong" },
  note: { icon: IconInfoCircle, word: "Note" },
  fine: { icon: IconCheck, word: "Fine" },
} as const;

const ORDER = ["wrong", "note", "fine"] as const;

function Found({ topic, verdict, what, advice }: Finding) {
  const { icon: Icon, word } = SIGNS[verdict];
  return (
    <li data-verdict={verdict}>
      <Icon size={16} aria-hidden />
      <div>
        <span className="visually-hidden">{word}: </span>
        <b>{topic}</b> {what}
        {advice && <p>{advice}</p>}
      </div>
    </li>
  );
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
  const sorted = ORDER.flatMap((verdict) => data?.filter((each) => each.verdict === verdict) ?? []);
  const wrong = data?.filter(({ verdict }) => verdict === "wrong").length;
  return (
    <section className={style.card} aria-label="Doctor">
      <div className={style.cardHead}>
        <h3>Doctor</h3>
        {wrong !== undefined && !isFetching && (
          <span className={style.version}>
            {wrong === 0 ? "Nothing is wrong." : `${wrong} ${wrong === 1 ? "is" : "are"} wrong.`}
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
      {error && !isFetching && <Alert color="red">{errorText(error)}</Alert>}
      {data === undefined && !isFetching && !error && (
        <p className={style.version}>
          The same as <code>action-assistant doctor</code> on the computer of the editor.
        </p>
      )}
      {data !== undefined && (
        <ul className={style.findings}>
          {sorted.map((each) => (
            <Found key={`${each.topic} ${each.what}`} {...each} />
          ))}
        </ul>
      )}
    </section>
  );
}
