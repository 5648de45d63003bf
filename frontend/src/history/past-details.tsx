/** The details while somebody looks at the history: who set what of what is selected, or what differs. */

import { Button, Skeleton } from "@mantine/core";
import { IconRestore } from "@tabler/icons-react";
import {
  memo,
  type ReactNode,
  useDeferredValue,
  useEffect,
  useMemo,
  useRef,
  useState,
} from "react";
import { useVersions, type Version } from "../api/graphs";
import { type FieldBlame, useBlame } from "../api/history";
import { CHANGE_SIGNS } from "../canvas/marks/change-marks";
import { type Panel, useEditorContext } from "../edit-actions/editor-context";
import { plainFieldWords } from "../graph/field-words";
import { endName } from "../graph/relation-words";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import { useStableCallback } from "../ui/hooks";
import { Segments } from "../ui/segments";
import { isolated } from "../words/isolated";
import { showThing } from "./changes-walk";
import { type ChangedThing, type GraphChanges, walkOrder } from "./graph-difference";
import style from "./past-details.module.css";
import { PastWays, useGoingBack } from "./restoring";
import { By, ValueHistory } from "./value-history";
import { blamedValue, toldFields } from "./value-spans";

const NONE: readonly Version[] = [];

interface Props {
  changes: GraphChanges | null;
  /** The panel that was asked for last: asking for one leads there. */
  panel: Panel;
  children: ReactNode;
}

function PastPart({ changes }: { changes: GraphChanges | null }) {
  const { graph, selection } = useEditorContext();
  const [only, ...others] = selection;
  if (only !== undefined && others.length === 0) {
    const gone = changes?.things.find(({ key }) => key === only)?.name;
    const isAction = graph.actions.some(({ key }) => key === only);
    const what = isAction ? endName(graph, only) : (gone ?? "it");
    return (
      <>
        <h2>{isAction ? what : (gone ?? "Arrow or note")}</h2>
        <WhoSetWhat key={only} of={only} what={what} />
      </>
    );
  }
  if (changes !== null) return <DifferenceList changes={changes} />;
  return <WhoSetWhat of="" what="the graph" />;
}

export function PastDetails({ changes: newest, panel, children }: Props) {
  // What stands beside the canvas follows it.
  const changes = useDeferredValue(newest);
  const { id, selection } = useEditorContext();
  const { data: versions = NONE } = useVersions(id);
  const [tab, setTab] = useState<"past" | "details">("past");
  const asked = useRef(panel);
  useEffect(() => {
    if (asked.current !== panel) setTab("details");
    asked.current = panel;
  }, [panel]);
  const label = selection.size === 1 || changes === null ? "Who set what" : "What differs";
  return (
    <div className="column">
      <div className={style.tabs}>
        <Segments
          label="What the details show"
          fullWidth
          size="xs"
          data={[
            { value: "past", label },
            { value: "details", label: "Details" },
          ]}
          value={tab}
          onChange={setTab}
        />
      </div>
      {tab === "past" ? (
        <section className={style.part} aria-label={label}>
          <PastPart changes={changes} />
          <PastWays versions={versions} />
        </section>
      ) : (
        <div className="fill-y">{children}</div>
      )}
    </div>
  );
}

interface BlameRowProps {
  of: string;
  blame: FieldBlame;
  color: string;
}

function BlameRow({ of, blame, color }: BlameRowProps) {
  const [open, setOpen] = useState(false);
  const { field, value, before } = blame;
  return (
    <li className="border-bottom">
      <button
        type="button"
        className={`${style.blame} finger`}
        aria-expanded={open}
        onClick={() => setOpen(!open)}
      >
        <span className="ink2">{plainFieldWords(field)}</span>
        <code>
          {before !== null && <del>{blamedValue(field, before)}</del>} {blamedValue(field, value)}
        </code>
        <span className={style.wide}>
          <By value={blame} color={color} />
        </span>
      </button>
      {open && <ValueHistory of={of} field={field} />}
    </li>
  );
}

/** `of`: the key of an action, an arrow or a note, or "" for the graph. `what`: how it is called. */
function WhoSetWhat({ of, what }: { of: string; what: string }) {
  const context = useEditorContext();
  const { id, past, mayGoBack } = context;
  const { seq } = useThrottledLink();
  const at = past?.at ?? seq;
  const found = useBlame(id, of, at);
  const colorOf = usePersonColors(found.data?.map(({ author }) => author.id));
  const { busy, restore } = useGoingBack(context);
  if (found.isPending) return <Skeleton height={120} />;
  if (found.isError) return <p className="ink2">It did not exist at that moment.</p>;
  return (
    <>
      <ul className={style.fields} aria-label="Who set what">
        {toldFields(found.data).map((blame) => (
          <BlameRow key={blame.field} of={of} blame={blame} color={colorOf(blame.author.id)} />
        ))}
      </ul>
      {past !== null && past.at < seq && mayGoBack && of !== "" && (
        <Button
          fullWidth
          variant="default"
          loading={busy}
          leftSection={<IconRestore size={15} aria-hidden />}
          onClick={() => void restore(past.at, of)}
        >
          Restore {what}
        </Button>
      )}
    </>
  );
}

const MOST = 200; // things in the list

interface ThingProps {
  thing: ChangedThing;
  onShow: (thing: ChangedThing) => void;
}

/** Return whether two changes are about the same thing with the same words. */
const isSameThing = (one: ChangedThing, other: ChangedThing): boolean =>
  one.key === other.key &&
  one.thing === other.thing &&
  one.change === other.change &&
  one.looks === other.looks &&
  one.name === other.name &&
  (one.lines === other.lines || one.lines.length + other.lines.length === 0);

const Thing = memo(
  function Thing({ thing, onShow }: ThingProps) {
    const { name, change, looks, lines } = thing;
    return (
      <li className={style.thing} data-change={looks ? "looks" : change}>
        <button type="button" className="finger" onClick={() => onShow(thing)}>
          <i aria-hidden>{looks ? "·" : CHANGE_SIGNS[change]}</i>
          <span>
            <b>{name}</b> <span className="ink2">{looks ? "only moved" : change}</span>
            {lines.map((line) => (
              <span key={line.name} className="block ink2">
                {isolated(line.name)} <del>{line.before ?? ""}</del> →{" "}
                <code>{line.after ?? "nothing"}</code>
              </span>
            ))}
          </span>
        </button>
      </li>
    );
  },
  (one, other) => one.onShow === other.onShow && isSameThing(one.thing, other.thing),
);

/** Rows draw again only where they say something else: who steps through moments waits for the canvas. */
function DifferenceList({ changes }: { changes: GraphChanges }) {
  const context = useEditorContext();
  const onShow = useStableCallback((thing: ChangedThing) => showThing(context, thing));
  const order = useMemo(() => walkOrder(changes.things), [changes]);
  if (order.length === 0) return <p className="ink2">Nothing differs.</p>;
  const more = order.length - MOST;
  return (
    <ul className={style.fields} aria-label="What differs, one by one">
      {order.slice(0, MOST).map((thing) => (
        <Thing key={`${thing.thing} ${thing.key}`} thing={thing} onShow={onShow} />
      ))}
      {more > 0 && <li className="ink2">and {more} more</li>}
    </ul>
  );
}
