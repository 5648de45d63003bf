/** Inputs and outputs of an action of the library, and the graphs that use it. */
import { Menu } from "@mantine/core";
import type { ReactElement } from "react";
import { Link } from "wouter";
import { useGraphNames } from "../api/graph-names";
import { useOpening } from "../ui/late-opening";
import type { KnownAction } from "./known-actions";
import style from "./sidebar.module.css";

export function ActionFacts({ button, known }: { button: ReactElement; known: KnownAction }) {
  const graphs = useGraphNames().data ?? [];
  const [opened, setOpened] = useOpening();
  const { template, usedIn, takes, gives } = known;
  return (
    <Menu position="right-start" width={270} opened={opened} onChange={setOpened}>
      <Menu.Target>{button}</Menu.Target>
      <Menu.Dropdown>
        <div className={style.facts}>
          <p>{template.description || "No description yet."}</p>
          {[
            ["Takes", takes],
            ["Gives", gives],
          ].map(([title, list]) =>
            list === undefined || list.length === 0 ? null : (
              <p key={String(title)}>
                <b>{title}</b> {(list as readonly string[]).join(" · ")}
              </p>
            ),
          )}
        </div>
        <Menu.Label>
          {usedIn.length === 1 ? "Used in 1 graph" : `Used in ${usedIn.length} graphs`}
        </Menu.Label>
        {usedIn.map((id) => (
          <Menu.Item key={id} component={Link} to={`/graphs/${id}`}>
            {graphs.find((graph) => graph.id === id)?.name || "Untitled"}
          </Menu.Item>
        ))}
      </Menu.Dropdown>
    </Menu>
  );
}
