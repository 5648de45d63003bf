/** Shows for each field of the selection who set its value, when, and its earlier values. */
import { Button, Skeleton } from "@mantine/core";
import { IconRestore } from "@tabler/icons-react";
import { useState } from "react";
import { type FieldBlame, useBlame } from "../api/history";
import { useEditorContext } from "../edit-actions/editor-context";
import { plainFieldWords } from "../graph/field-words";
import { usePersonColors, useThrottledLink } from "../sync/use-room";
import style from "./past-details.module.css";
import { useGoingBack } from "./restoring";
import { By, ValueHistory } from "./value-history";
import { blamedValue, toldFields } from "./value-spans";

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
export function WhoSetWhat({ of, what }: { of: string; what: string }) {
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
          Make {what} so again
        </Button>
      )}
    </>
  );
}
