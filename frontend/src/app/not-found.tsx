/** An address that leads nowhere, or to a graph that is no more. */
import { Button } from "@mantine/core";
import { IconMapOff } from "@tabler/icons-react";
import type { ReactNode } from "react";
import { Link } from "wouter";
import { Empty } from "../ui/empty";
import { PageBar, PageFrame } from "./page-frame";

interface Props {
  /** Where one is, in the bar. */
  crumb: string;
  title: string;
  children?: ReactNode;
}

/** What stands in the place of a page, and the way to all graphs. */
export function Nowhere({ crumb, title, children }: Props) {
  return (
    <>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: crumb }]} />
      <main>
        <Empty
          icon={<IconMapOff size={22} />}
          title={title}
          action={
            <Button component={Link} to="/">
              All graphs
            </Button>
          }
        >
          {children}
        </Empty>
      </main>
    </>
  );
}

export function NotFound() {
  return (
    <PageFrame>
      <Nowhere crumb="Nowhere" title="There is nothing at this address" />
    </PageFrame>
  );
}
