/** A deed's first shortcut, as it is printed on keys. */
import { Kbd } from "@mantine/core";
import style from "../editor/menus/toolbar.module.css";
import { type Deed, keysOf } from "./edit-action";

export function Keys({ shortcut }: { shortcut: string }) {
  return (
    <span className={style.keys}>
      {keysOf(shortcut).map((key) => (
        <Kbd key={key}>{key}</Kbd>
      ))}
    </span>
  );
}

export function Shortcut({ deed }: { deed: Deed }) {
  const [first] = deed.shortcuts;
  return first === undefined ? null : <Keys shortcut={first} />;
}
