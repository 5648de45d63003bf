/** Who gave each field of what is selected its value, when, what it was before, and all its values. */
import { Button, Skeleton } from "@mantine/core";
import { IconRestore } from "@tabler/icons-react";
import { type CSSProperties, useState } from "react";
import {
  type FieldBlame,
  type FieldValue,
  useBlame,
  useFieldValues,
} from "../api/documents/history";
import { authorName } from "../api/graphs";
import { errorText } from "../api/http";
import { useEditorContext } from "../edit-actions/editor-context";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import { day, hourMinute, instant, useNow } from "../ui/times";
import { blamedName, blamedValue, toldFields } from "./blame-words";
import style from "./past-details.module.css";
import { useGoingBack } from "./ways/going-back";

function By({ value, color }: { value: Pick<FieldValue, "author" | "at">; color: string }) {
  const now = useNow(60_000);
  const at = instant(value.at);
  return (
    <span className={style.by}>
      <i style={{ "--c": color } as CSSProperties} aria-hidden />
      <bdi>{authorName(value.author)}</bdi>
      {at !== null && ` · ${day(at, now)} ${hourMinute(at)}`}
    </span>
  );
}

interface ValuesProps {
  of: string;
  field: string;
  at: number;
}

/** All values that it has had; each leads to its moment. */
function Values({ of, field, at }: ValuesProps) {
  const { id, lookAt } = useEditorContext();
  const found = useFieldValues(id, of, field, at);
  const colorOf = usePersonColors(found.data?.map(({ author }) => author.id));
  if (found.isPending) return <Skeleton height={40} />;
  if (found.isError) return <p role="alert">{errorText(found.error)}</p>;
  return (
    <ol className={style.values} aria-label={`Values of ${blamedName(field)}`}>
      {found.data.map((value) => (
        <li key={value.seq}>
          <button type="button" onClick={() => lookAt({ at: value.seq, with: "own" })}>
            <code>{blamedValue(field, value.value)}</code>
            <By value={value} color={colorOf(value.author.id)} />
            <span className="visually-hidden">Look at that moment</span>
          </button>
        </li>
      ))}
    </ol>
  );
}

interface BlameRowProps {
  of: string;
  blame: FieldBlame;
  at: number;
  color: string;
}

function BlameRow({ of, blame, at, color }: BlameRowProps) {
  const [open, setOpen] = useState(false);
  const { field, value, before } = blame;
  return (
    <li className={style.field}>
      <button
        type="button"
        className={style.blame}
        aria-expanded={open}
        onClick={() => setOpen(!open)}
      >
        <span className={style.name}>{blamedName(field)}</span>
        <code>
          {before !== null && <del>{blamedValue(field, before)}</del>} {blamedValue(field, value)}
        </code>
        <By value={blame} color={color} />
      </button>
      {open && <Values of={of} field={field} at={at} />}
    </li>
  );
}

/** `of`: the key of an action, an arrow or a note, or "" for the graph. `what`: how it is called. */
export function WhoSetWhat({ of, what }: { of: string; what: string }) {
  const context = useEditorContext();
  const { id, past, mayGoBack } = context;
  const { seq } = useThrottledLink();
  const at = past?.at ?? seq;
  const found = useBlame(id, of, at);
  const colorOf = usePersonColors(found.data?.map(({ author }) => author.id));
  const { busy, restore } = useGoingBack(context);
  if (found.isPending) return <Skeleton height={120} />;
  if (found.isError) return <p className={style.quiet}>It was not there at that moment.</p>;
  return (
    <>
      <ul className={style.fields} aria-label="Who set what">
        {toldFields(found.data).map((blame) => (
          <BlameRow
            key={blame.field}
            of={of}
            blame={blame}
            at={at}
            color={colorOf(blame.author.id)}
          />
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
          Make {what} so again
        </Button>
      )}
    </>
  );
}
