/** A start that does not begin at the entry: where it begins, and all that it takes for granted. */
import { Textarea } from "@mantine/core";
import { useDebouncedValue } from "@mantine/hooks";
import { type ReactNode, useState } from "react";
import { SIMULATOR } from "../../api/robots";
import type { Earlier, StartFrom } from "../../api/starts";
import { spokenName } from "../../graph/spoken-name";
import { type Beginning, CHOICES, type Choice, EarlierList } from "../../status/earlier-list";
import { useKeptText } from "../../ui/kept-texts";
import { isolated } from "../../words/isolated";
import style from "./start-from.module.css";

const TYPING = 400; // ms without a key until it is looked at
const isWord = (choice: Choice | undefined) => choice !== "again" && choice !== "leave";

export interface StartFromChoice {
  /** The place in the form in which it is looked at and sent; undefined for the entry. */
  readonly from: StartFrom | undefined;
  /** Text that says what is needed before anything is started; null if nothing is. */
  obstacle(earlier: Earlier | null | undefined): string | null;
  /** Forgets the reason, once it was sent. */
  forget(): void;
  /** The questions and lists; nothing for a start at the entry. */
  part(earlier: Earlier | null | undefined): ReactNode;
}

/** Remember what a person chooses for actions that were under way. Nothing is chosen for them. `place`:
 * under which their reason is kept. */
export function useStartFrom(beginning: Beginning | undefined, place: string): StartFromChoice {
  const [choices, setChoices] = useState<Readonly<Record<string, Choice>>>({});
  const [reason, setReason] = useKeptText(place);
  const [settled] = useDebouncedValue(reason.trim(), TYPING);
  if (beginning === undefined) {
    return { from: undefined, obstacle: () => null, part: () => null, forget: () => undefined };
  }
  const hasWords = Object.values(choices).some(isWord);
  const sent = Object.entries(choices).filter(([, each]) => settled !== "" || !isWord(each));
  const { run, at, only } = beginning;
  const from: StartFrom = {
    run,
    at: [...at],
    only,
    ...(sent.length > 0 && { choices: Object.fromEntries(sent) }),
    ...(hasWords && settled !== "" && { reason: settled }),
  };
  return {
    from,
    forget: () => setReason(""),
    obstacle: (earlier) => {
      const open = earlier?.under_way.find(({ action }) => choices[action] === undefined);
      if (open !== undefined) return `Choose for ${isolated(spokenName(open.action))}`;
      if (hasWords && reason.trim() === "") return "Say how you know it";
      return hasWords && settled !== reason.trim() ? "Looking …" : null;
    },
    part: (earlier) =>
      earlier && (
        <section className={style.part} aria-label="What is taken for granted">
          {earlier.under_way.map((each) => (
            <Question
              key={each.action}
              of={each}
              chosen={choices[each.action]}
              onChoose={(choice) => setChoices({ ...choices, [each.action]: choice })}
            />
          ))}
          {hasWords && (
            <Textarea
              label="How do you know the outcome? It is recorded as your word."
              value={reason}
              maxLength={500}
              autosize
              minRows={2}
              onChange={(event) => setReason(event.currentTarget.value)}
            />
          )}
          <EarlierList earlier={earlier} />
        </section>
      ),
  };
}

interface QuestionProps {
  of: Earlier["under_way"][number];
  chosen: Choice | undefined;
  onChoose: (choice: Choice) => void;
}

function Question({ of: { action, robot, seen }, chosen, onChoose }: QuestionProps) {
  const where = robot === SIMULATOR ? "the simulator" : isolated(robot);
  return (
    <fieldset className={style.question}>
      <legend>
        {isolated(spokenName(action))} on {where} had begun
      </legend>
      <p className="m-0 text-sm">
        {seen
          ? `After Stop it was seen to end with ${seen.replace("on_", "")}.`
          : "It was stopped before it had an outcome."}
      </p>
      {CHOICES.map(([value, words]) => (
        <label key={value} className="finger">
          <input
            type="radio"
            name={`choice ${action}`}
            checked={chosen === value}
            onChange={() => onChoose(value)}
          />
          {words}
        </label>
      ))}
    </fieldset>
  );
}
