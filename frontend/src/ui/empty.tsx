/** An empty place that says what belongs there and how to fill it. */
import type { ReactNode } from "react";
import style from "./empty.module.css";

interface Props {
  icon: ReactNode;
  title: string;
  children?: ReactNode;
  action?: ReactNode;
}

export function Empty({ icon, title, children, action }: Props) {
  return (
    <div className={style.empty}>
      <div className={style.icon} aria-hidden>
        {icon}
      </div>
      <h2 className={style.title}>{title}</h2>
      {children && <div className={style.text}>{children}</div>}
      {action && <div className={style.action}>{action}</div>}
    </div>
  );
}
