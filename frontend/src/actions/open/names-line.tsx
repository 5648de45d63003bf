/** What follows from the name of an action: package, class and library, or why there can be none. */
import { usePackagesAt } from "../../api/packages";
import style from "./open.module.css";

interface Props {
  id: string;
  seq: number;
  name: string;
}

export function NamesLine({ id, seq, name }: Props) {
  const list = usePackagesAt(id, seq).data;
  const outline = list?.packages.find(({ action }) => action === name);
  if (outline !== undefined) {
    return (
      <p className={style.names}>
        Package <code>{outline.package}</code> · class <code>{name}</code> · library{" "}
        <code>lib{outline.package}.so</code>
      </p>
    );
  }
  const reasons = (list?.refusals ?? []).filter(({ place }) => place === name);
  return reasons.map(({ reason }) => (
    <p key={reason} className={style.names} data-wrong>
      No C++ package: {reason}
    </p>
  ));
}
