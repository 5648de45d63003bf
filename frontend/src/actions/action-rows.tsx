/** Rows of actions: each drawn once, and laid out only near what is in sight. */
import { IconAlertTriangle } from "@tabler/icons-react";
import { memo } from "react";
import { useRouter } from "wouter";
import { LongList } from "../ui/long-list";
import style from "./actions-page.module.css";
import { addressOf, type ListedAction } from "./listing";

interface ActionRowProps {
  listed: ListedAction;
  base: string;
  current: boolean;
}

/** Where it comes from, when that is not the library. */
function source({ action }: ListedAction): string {
  if (action === null) return "on a robot";
  return action.document === null ? "only in graphs" : "";
}

const Row = memo(function Row({ listed, base, current }: ActionRowProps) {
  const { name, summary, action } = listed;
  const uses = action?.used_in.length ?? 0;
  const older = action?.differs_in.length ?? 0;
  const from = source(listed);
  return (
    <a
      href={base + addressOf(listed)}
      className={style.row}
      aria-current={current ? "page" : undefined}
      data-row
    >
      <span className={style.name}>
        <bdi>{name || "Without a name"}</bdi>
        {older > 0 && (
          <span className={style.older} title={`Older parameters in ${older}`}>
            <IconAlertTriangle size={13} aria-hidden />
            <span className="visually-hidden"> older parameters in {older}</span>
          </span>
        )}
        {uses > 0 && (
          <span className={style.count} title={`Used in ${uses}`}>
            <span className="visually-hidden"> used in </span>
            {uses}×
          </span>
        )}
      </span>
      <span className={style.sub}>
        {from !== "" && <i>{from}</i>}
        {summary}
      </span>
    </a>
  );
});

interface Props {
  actions: readonly ListedAction[];
  current: string | null;
}

export function ActionRows({ actions, current }: Props) {
  const { base } = useRouter();
  return (
    <LongList rowHeight={3}>
      {actions.map((listed) => (
        <Row
          key={listed.name}
          listed={listed}
          base={base}
          current={addressOf(listed) === current}
        />
      ))}
    </LongList>
  );
}
