/** Questions of a led run to people: each has a form that says what follows, and by when. */

import { Button, FileButton, TextInput } from "@mantine/core";
import { notifications } from "@mantine/notifications";
import { IconCamera, IconMessageQuestion, IconSend } from "@tabler/icons-react";
import { useMutation } from "@tanstack/react-query";
import { type ReactNode, useState } from "react";
import { errorText, isOutcomeUnknown } from "../api/http";
import { useLive } from "../api/page-link";
import {
  answerQuestion,
  type Question,
  type Said,
  sendPhoto,
  useMayAnswer,
} from "../api/questions";
import type { Run } from "../api/runs";
import { shiftOfRun } from "../api/site-places";
import { usePendingText } from "../ui/drafts";
import { HoldButton } from "../ui/hold-button";
import { clock, duration, instant, useNow } from "../ui/times";
import { isolated } from "../words/isolated";
import style from "./held-notice.module.css";
import { actionWords } from "./level-places";
import { useWatching, WatchTicks } from "./watching";

const PICTURES = "image/jpeg,image/png,image/webp";

/** Return until when a question can be answered, and what follows; "" for no limit. */
export function limitWords(question: Question, now: number): string {
  const deadline = instant(question.deadline);
  const lapse = instant(question.lapses_at);
  const in_ = (at: number) => `${clock(at)}, in ${duration(Math.max(0, at - now))}`;
  const end =
    deadline === null
      ? ""
      : `Without an answer it ends ${question.at_deadline ?? "error"} at ${in_(deadline)}.`;
  const again =
    lapse === null || (deadline !== null && deadline <= lapse)
      ? ""
      : `Asked again at ${in_(lapse)}.`;
  return [end, again].filter((each) => each !== "").join(" ");
}

/** Return what an answer may set going. */
export function movesAfter(question: Question): string {
  const robots = (question.moves ?? []).map(isolated);
  return robots.length === 0 ? "" : `${robots.join(", ")} may begin to move.`;
}

function failure(error: unknown) {
  const message = errorText(error);
  if (!isOutcomeUnknown(error)) return { color: "red", title: "Not answered", message };
  const title = "NOT KNOWN whether the answer was stored";
  return { color: "red", autoClose: false as const, title, message };
}

interface SendProps {
  /** The answer; null while there is none. */
  said: Said | null;
  /** Shown on the button. */
  label: string;
  question: Question;
  icon?: ReactNode;
  disabled: boolean;
  onSend: (said: Said) => void;
}

/** The button that sends an answer: held where robots may move then. */
function SendButton({ said, label, question, icon, disabled, onSend }: SendProps) {
  const moves = movesAfter(question);
  const send = () => said !== null && onSend(said);
  if (moves === "" || (said !== null && "cannot" in said))
    return (
      <Button
        size="compact-sm"
        leftSection={icon}
        disabled={disabled || said === null}
        onClick={send}
      >
        {label}
      </Button>
    );
  return (
    <HoldButton
      size="compact-sm"
      icon={icon}
      label={label}
      name={`${label}: ${isolated(question.text)} ${moves}`}
      question={`${isolated(question.text)} ${label}? ${moves}`}
      disabled={disabled || said === null}
      onHeld={send}
    />
  );
}

interface FieldProps {
  question: Question;
  disabled: boolean;
  onSend: (said: Said) => void;
}

function YesOrNo(props: FieldProps) {
  return (
    <>
      <SendButton {...props} said={{ value: true }} label="Yes" />
      <SendButton {...props} said={{ value: false }} label="No" />
    </>
  );
}

function Choices(props: FieldProps) {
  return (props.question.choices ?? []).map((choice) => (
    <SendButton key={choice} {...props} said={{ value: choice }} label={choice} />
  ));
}

function TextField(props: FieldProps) {
  const [text, setText] = useState("");
  usePendingText(text, null);
  return (
    <>
      <TextInput
        size="xs"
        className={style.reason ?? ""}
        aria-label={props.question.text}
        maxLength={4000}
        value={text}
        onChange={(event) => setText(event.currentTarget.value)}
      />
      <SendButton
        {...props}
        icon={<IconSend size={14} aria-hidden />}
        said={text.trim() === "" ? null : { value: text.trim() }}
        label="Answer"
      />
    </>
  );
}

/** Return the number that a text is, with a point or a comma; null if it is none. */
export function numberIn(text: string): number | null {
  const number = Number(text.trim().replace(",", "."));
  return text.trim() === "" || !Number.isFinite(number) ? null : number;
}

function NumberField(props: FieldProps) {
  const { at_least: least, at_most: most, text } = props.question;
  const [typed, setTyped] = useState("");
  usePendingText(typed, null);
  const value = numberIn(typed);
  const fits = value !== null && value >= (least ?? -Infinity) && value <= (most ?? Infinity);
  const bounds = [
    least === undefined ? "" : `at least ${least}`,
    most === undefined ? "" : `at most ${most}`,
  ].filter((each) => each !== "");
  return (
    <>
      <TextInput
        size="xs"
        className={style.reason ?? ""}
        aria-label={[text, ...bounds].join(", ")}
        placeholder={bounds.join(", ") || "A number"}
        inputMode="decimal"
        error={
          typed !== "" && !fits
            ? `A number${bounds.length > 0 ? ` ${bounds.join(", ")}` : ""}`
            : null
        }
        value={typed}
        onChange={(event) => setTyped(event.currentTarget.value)}
      />
      <SendButton
        {...props}
        icon={<IconSend size={14} aria-hidden />}
        said={fits ? { value } : null}
        label="Answer"
      />
    </>
  );
}

/** `onPhoto`: sends the picture and answers with it. */
function PhotoField({ disabled, onPhoto }: { disabled: boolean; onPhoto: (photo: File) => void }) {
  return (
    <FileButton accept={PICTURES} capture="environment" onChange={(file) => file && onPhoto(file)}>
      {(button) => (
        <Button
          {...button}
          size="compact-sm"
          leftSection={<IconCamera size={15} aria-hidden />}
          disabled={disabled}
        >
          Take or choose a photo
        </Button>
      )}
    </FileButton>
  );
}

function Cannot(props: FieldProps) {
  const [why, setWhy] = useState<string | null>(null);
  usePendingText(why ?? "", null);
  if (why === null)
    return (
      <Button
        size="compact-sm"
        variant="subtle"
        disabled={props.disabled}
        onClick={() => setWhy("")}
      >
        I cannot …
      </Button>
    );
  return (
    <>
      <TextInput
        size="xs"
        className={style.reason ?? ""}
        aria-label="Why can it not be answered?"
        placeholder="Why not?"
        maxLength={500}
        value={why}
        onChange={(event) => setWhy(event.currentTarget.value)}
      />
      <SendButton
        {...props}
        said={why.trim() === "" ? null : { cannot: why.trim() }}
        label="Send: it ends false"
      />
    </>
  );
}

function AnswerForm({ run, question }: { run: Run; question: Question }) {
  const { live, runner, now } = useLive(run.id);
  const watch = useWatching(question.moves ?? []);
  const answer = useMutation({
    mutationFn: async (said: Said | File) => {
      const at = [runner ?? "", run.id, question.id] as const;
      const words = said instanceof File ? { value: await sendPhoto(...at, said) } : said;
      return answerQuestion(...at, words, watch.watching);
    },
    onSuccess: (fresh) => live?.learn(fresh),
    onError: (error) => notifications.show(failure(error)),
    onSettled: watch.forget,
  });
  const obstacle = answer.isPending ? "Sending …" : watch.obstacle;
  const props = {
    question,
    disabled: obstacle !== null || now.link !== "live",
    onSend: answer.mutate,
  };
  return (
    <div className={style.outcome}>
      <WatchTicks watch={watch} />
      {question.kind === "confirm" && <YesOrNo {...props} />}
      {question.kind === "choice" && <Choices {...props} />}
      {question.kind === "text" && <TextField {...props} />}
      {question.kind === "number" && <NumberField {...props} />}
      {question.kind === "photo" && (
        <PhotoField disabled={props.disabled} onPhoto={answer.mutate} />
      )}
      {question.kind !== "confirm" && <Cannot {...props} />}
      {obstacle !== null && <span role="status">{obstacle}</span>}
    </div>
  );
}

function Asked({ run, question, why }: { run: Run; question: Question; why: string }) {
  const now =
    useNow(1000, question.deadline !== undefined || question.lapses_at !== undefined) -
    shiftOfRun(run.id);
  const role = question.role ? `${isolated(question.role)} is asked. ` : "";
  return (
    <section
      className={style.notice}
      aria-label={`Question of ${isolated(actionWords(run, question.action))}`}
    >
      <IconMessageQuestion size={17} aria-hidden />
      <p>
        <b role="alert">{question.text}</b> {role}
        {movesAfter(question)} {limitWords(question, now)}
      </p>
      {why === "" ? <AnswerForm run={run} question={question} /> : <span>{why}</span>}
    </section>
  );
}

/** The waits of the runner itself: for how long, or until when. */
function Pauses({ run }: { run: Run }) {
  const now = useNow(1000, (run.pauses ?? []).length > 0) - shiftOfRun(run.id);
  return (run.pauses ?? []).map(({ action, until }) => {
    const at = instant(until);
    return (
      <p key={action} className={style.notice}>
        <span>
          {isolated(actionWords(run, action))} waits
          {at !== null && ` until ${clock(at)}, ${duration(Math.max(0, at - now))} more`}.
        </span>
      </p>
    );
  });
}

export function AskedPeople({ run }: { run: Run }) {
  const { runner } = useLive();
  const open = run.ended_at === null ? (run.questions ?? []) : [];
  const known = useMayAnswer(
    runner,
    open.map(({ id }) => ({ id, run: run.id })),
  );
  return (
    <>
      {open.map((question) => {
        const about = known(question.id);
        const why = about?.may === false ? about.why || "Others are asked." : "";
        return (
          <Asked
            key={question.id}
            run={run}
            question={question}
            why={about === undefined ? "Looking whether you may answer …" : why}
          />
        );
      })}
      {run.ended_at === null && <Pauses run={run} />}
    </>
  );
}
