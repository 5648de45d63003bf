/** The question of another device of the same person, on whatever page is open: is it you? */
import { Button, Group } from "@mantine/core";
import { useState } from "react";
import { type AskedConfirmation, answerConfirmation } from "../api/confirmations";
import { errorText } from "../api/http";
import { useLive } from "../api/page-link";
import { isolated } from "../words/isolated";
import style from "./confirm-question.module.css";

export function ConfirmQuestion() {
  const { now } = useLive();
  const [asked] = now.asked;
  return asked === undefined ? null : <Question key={asked.id} asked={asked} />;
}

function Question({ asked }: { asked: AskedConfirmation }) {
  const { runner } = useLive();
  const [problem, setProblem] = useState("");
  const [busy, setBusy] = useState(false);
  const say = async (yes: boolean) => {
    setBusy(true);
    try {
      await answerConfirmation(runner ?? "", asked.id, yes);
    } catch (error) {
      setProblem(errorText(error));
      setBusy(false);
    }
  };
  const what =
    asked.robots.length > 0
      ? `start on ${asked.robots.map(isolated).join(", ")}`
      : "do something that only you may do";
  const place = asked.address === "" ? "" : ` at ${asked.address}`;
  return (
    <section className={style.question} role="alertdialog" aria-label="Is it you?">
      <p>
        <b>Is it you?</b> {isolated(asked.browser)}
        {place} wants to {what}. Does it show <b className={style.number}>{asked.number}</b>?
      </p>
      {problem !== "" && (
        <p className="ink-error text-13" role="alert">
          {problem}
        </p>
      )}
      <Group gap="sm">
        <Button variant="filled" disabled={busy} onClick={() => void say(true)}>
          Yes, it is me
        </Button>
        <Button disabled={busy} onClick={() => void say(false)}>
          No
        </Button>
      </Group>
    </section>
  );
}
