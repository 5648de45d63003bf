/** Asks a person for the outcome of an action of a led run that ended without one. */
import { TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconHelpCircle, IconMessageCheck } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { useState } from "react";
import { errorText, isOutcomeUnknown } from "../api/http";
import { useLive } from "../api/page-link";
import { useMay } from "../api/people";
import { giveOutcome, type SaidOutcome } from "../api/presses";
import type { Run } from "../api/runs";
import { usePendingText } from "../ui/drafts";
import { HoldButton } from "../ui/hold-button";
import { Segments } from "../ui/segments";
import { isolated } from "../words/isolated";
import style from "./held-notice.module.css";
import { actionWords } from "./level-places";
import { askedOutcomes } from "./rests";

const OUTCOMES = [
  { value: "true", label: "True" },
  { value: "false", label: "False" },
  { value: "error", label: "Error" },
] as const;

function failure(error: unknown) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) return { color: "red", title: "Not stored", message };
  const title = "NOT KNOWN whether the outcome was stored";
  return { color: "red", autoClose: false as const, title, message };
}

function OutcomeForm({ run, action }: { run: Run; action: string }) {
  // Of the visit that is asked about: a word that arrives late counts for no later one.
  const piece = run.actions?.[action]?.piece ?? "";
  const { live, runner, now } = useLive(run.id);
  const [outcome, choose] = useState<SaidOutcome | "">("");
  const [reason, setReason] = useState("");
  // Never kept for later: the words are about what was seen a moment ago.
  usePendingText(reason, null);
  const give = useMutation({
    mutationFn: (said: SaidOutcome) =>
      giveOutcome(runner ?? "", run.id, { action, outcome: said, reason, piece }),
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error)),
  });
  const words = actionWords(run, action);
  const ready = outcome !== "" && reason.trim() !== "";
  const then = run.held
    ? "Nothing begins before somebody lets the run go on."
    : "The actions that wait for this outcome begin at once, and their robots may begin to move.";
  return (
    <div className={style.outcome}>
      <Segments
        label={`Outcome of ${words}`}
        size="xs"
        data={OUTCOMES}
        value={outcome}
        onChange={choose}
      />
      <TextInput
        size="xs"
        className={style.reason ?? ""}
        aria-label={`What shows the outcome of ${words}?`}
        placeholder="What did you see?"
        maxLength={500}
        value={reason}
        onChange={(event) => setReason(event.currentTarget.value)}
      />
      <HoldButton
        size="compact-sm"
        icon={<IconMessageCheck size={14} aria-hidden />}
        label={give.isPending ? "Sending …" : "Hold to say so"}
        name={
          ready
            ? `Say that ${words} ended ${outcome}`
            : `First choose the outcome of ${words}, and say what you saw`
        }
        question={`Did ${words} end ${outcome}? ${then}`}
        disabled={!ready || give.isPending || now.link !== "live"}
        onHeld={() => outcome !== "" && give.mutate(outcome)}
      />
    </div>
  );
}

export function OutcomeQuestions({ run }: { run: Run }) {
  const may = useMay(run.simulated ? "simulate" : "operate");
  return askedOutcomes(run).map((action) => {
    const robot = run.actions?.[action]?.robot;
    const where = robot ? ` on ${isolated(robot)}` : "";
    return (
      <section
        key={`${action} ${run.actions?.[action]?.piece}`}
        className={style.notice}
        aria-label={`Outcome of ${actionWords(run, action)}`}
      >
        <IconHelpCircle size={17} aria-hidden />
        <p role="alert">
          <b>
            {actionWords(run, action)}
            {where} has ended, and nothing shows its outcome.
          </b>{" "}
          {may
            ? "Which outcome was it? Your answer is stored as your word, not as observed."
            : "Operators can say what it was."}
        </p>
        {may && <OutcomeForm run={run} action={action} />}
      </section>
    );
  });
}
