/** An address that leads nowhere. */
import { Button } from "@mantine/core";
import { IconMapOff } from "@tabler/icons-react";
import { Link } from "wouter";
import { Empty } from "../ui/empty";
import { PageBar, PageFrame } from "./page-frame";

export function NotFound() {
  return (
    <PageFrame>
      <PageBar crumbs={[{ label: "Graphs", to: "/" }, { label: "Nowhere" }]} />
      <main>
        <Empty
          icon={<IconMapOff size={22} />}
          title="There is nothing at this address"
          action={
            <Button component={Link} to="/">
              All graphs
            </Button>
          }
        />
      </main>
    </PageFrame>
  );
}
