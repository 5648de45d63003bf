/** What an arrow says: a response to each of the four outcomes, and what it carries over. */
import { ActionIcon, Button, Select, Switch, TextInput } from "@mantine/core";
import { IconArrowDown, IconTrash, IconX } from "@tabler/icons-react";
import { useState } from "react";
import { removeRelation, setRemap, setRequired, setResponse } from "../../graph/edit";
import { relationId } from "../../graph/layout";
import { ENTRY, EXIT, RESPONSES, type Relation, type Response } from "../../graph/model";
import { relationWords } from "../../graph/words";
import { OUTCOMES, OutcomeSign, outcomeColor, outcomeWord } from "../../ui/outcome";
import { endName, useBench } from "../bench";
import style from "./details.module.css";

const meaning: Record<Response, string> = {
  run: "run it",
  ignore: "do nothing",
  bypass: "pass it over",
  stop: "stop it",
  pause: "pause it",
  restart: "start it again",
};

const responses = RESPONSES.map((value) => ({ value, label: `${value} · ${meaning[value]}` }));

function Remaps({ relation }: { relation: Relation }) {
  const { doc, graph } = useBench();
  const [source, setSource] = useState("");
  const [target, setTarget] = useState("");
  const id = relationId(relation);
  const parent = graph.actions.find((action) => action.key === relation.parent);
  const child = graph.actions.find((action) => action.key === relation.child);
  const flat = (path: string) => path.replaceAll("/", "::").replaceAll("~1", "/");
  const outputs = (parent?.outputs ?? []).map((parameter) => flat(parameter.path));
  const inputs = (child?.inputs ?? []).map((parameter) => flat(parameter.path));
  return (
    <section className={style.section}>
      <div className={style.heading}>
        <h3>Outputs under another name</h3>
      </div>
      {relation.remap.map((remap) => (
        <div className={style.arrow} key={remap.source}>
          <span className={style.mono}>
            {remap.source} → {remap.target}
          </span>
          <ActionIcon
            size="sm"
            aria-label={`Remove ${remap.source} to ${remap.target}`}
            onClick={() => setRemap(doc, id, remap.source, null)}
          >
            <IconX size={13} />
          </ActionIcon>
        </div>
      ))}
      <form
        className={style.connect}
        onSubmit={(event) => {
          event.preventDefault();
          if (source.trim() === "" || target.trim() === "") return;
          setRemap(doc, id, source.trim(), target.trim());
          setSource("");
          setTarget("");
        }}
      >
        <TextInput
          aria-label="Output"
          placeholder="output"
          list={`${id}-outputs`}
          value={source}
          onChange={(event) => setSource(event.currentTarget.value)}
          flex={1}
        />
        <TextInput
          aria-label="Reaches it as"
          placeholder="reaches it as"
          list={`${id}-inputs`}
          value={target}
          onChange={(event) => setTarget(event.currentTarget.value)}
          flex={1}
        />
        <Button type="submit" disabled={source.trim() === "" || target.trim() === ""}>
          Add
        </Button>
        <datalist id={`${id}-outputs`}>
          {outputs.map((name) => (
            <option key={name} value={name} />
          ))}
        </datalist>
        <datalist id={`${id}-inputs`}>
          {inputs.map((name) => (
            <option key={name} value={name} />
          ))}
        </datalist>
      </form>
    </section>
  );
}

export function RelationForm({ relation }: { relation: Relation }) {
  const bench = useBench();
  const { doc, graph } = bench;
  const id = relationId(relation);
  const parent = endName(graph, relation.parent);
  const child = endName(graph, relation.child);
  const entry = relation.parent === ENTRY;
  return (
    <div className={style.form}>
      <div className={style.ends}>
        <button type="button" className={style.end} onClick={() => bench.select([relation.parent])}>
          {parent}
        </button>
        <IconArrowDown size={15} aria-label="leads to" />
        <button type="button" className={style.end} onClick={() => bench.select([relation.child])}>
          {child}
        </button>
      </div>
      {entry ? (
        <p className={style.hint}>The graph starts with {child}.</p>
      ) : (
        <>
          <section className={style.section}>
            {OUTCOMES.map((outcome) => (
              <div className={style.answer} key={outcome}>
                <span className={style.when} style={{ color: outcomeColor[outcome] }}>
                  <OutcomeSign outcome={outcome} /> {outcomeWord[outcome]}
                </span>
                <Select
                  aria-label={`When ${parent} is ${outcomeWord[outcome]}`}
                  data={responses}
                  value={relation.conditions[outcome]}
                  onChange={(next) => setResponse(doc, id, outcome, (next ?? "ignore") as Response)}
                  flex={1}
                />
              </div>
            ))}
          </section>
          <div className={style.say}>
            <div>
              {relationWords(graph, relation).map((sentence) => (
                <p key={sentence}>{sentence}</p>
              ))}
            </div>
          </div>
          <Switch
            label={`${child} waits for this`}
            description={
              relation.required
                ? `It ${relation.child === EXIT ? "ends the graph" : "runs"} only after all that it waits for have reported.`
                : "Optional: it need not report."
            }
            checked={relation.required}
            onChange={(event) => setRequired(doc, id, event.currentTarget.checked)}
          />
          <Remaps relation={relation} />
        </>
      )}
      <Button
        leftSection={<IconTrash size={14} />}
        color="red"
        variant="subtle"
        onClick={() => {
          removeRelation(doc, id);
          bench.select([]);
        }}
      >
        Delete this arrow
      </Button>
    </div>
  );
}
