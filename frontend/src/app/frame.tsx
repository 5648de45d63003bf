/** What every screen has: the bar with STOP on top, the screen below. */
import { Button } from "@mantine/core";
import { IconHistory } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { Link } from "wouter";
import { AccountMenu } from "../account/account-menu";
import { StopButton } from "../runs/stop-button";
import { type Crumb, TopBar } from "../ui/top-bar";
import style from "./frame.module.css";

interface Props {
  crumbs: readonly Crumb[];
  status?: ReactNode;
  actions?: ReactNode;
  start?: ReactNode;
  /** The graph on screen. */
  graph?: string;
  /** The screen is the history itself. */
  history?: boolean;
}

export function Bar({ crumbs, status, actions, start, graph, history = false }: Props) {
  return (
    <TopBar
      crumbs={crumbs}
      status={status}
      actions={
        <>
          {actions}
          {!history && (
            <Button
              component={Link}
              to="/runs"
              variant="subtle"
              color="gray"
              px="sm"
              leftSection={<IconHistory size={16} aria-hidden />}
              className={style.history ?? ""}
              data-tight={start ? true : undefined}
            >
              Runs
            </Button>
          )}
        </>
      }
      account={<AccountMenu />}
      start={start}
      stop={<StopButton {...(graph === undefined ? {} : { graph })} />}
    />
  );
}

/** Bar above, screen below, each scrolling by itself. */
export function Frame({ children }: { children: ReactNode }) {
  return <div className={style.frame}>{children}</div>;
}
