/** One notice over the canvas, with a button for what the person can do. */
import type { ReactNode } from "react";
import style from "./room-notices.module.css";

interface NoticeProps {
  icon: ReactNode;
  tone?: "warn";
  children: ReactNode;
  action?: ReactNode;
}

export function Notice({ icon, tone, children, action }: NoticeProps) {
  return (
    <div className={style.say} data-tone={tone}>
      <span className="grid ink2" aria-hidden>
        {icon}
      </span>
      <span className={style.words}>{children}</span>
      {action}
    </div>
  );
}
