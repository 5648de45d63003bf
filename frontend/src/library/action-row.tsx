/** An action of the library: dragged or tapped onto the canvas; what it takes, and where it is used. */
import { ActionIcon, Menu } from "@mantine/core";
import { IconGripVertical, IconInfoCircle } from "@tabler/icons-react";
import { Link } from "wouter";
import { useGraphs } from "../api/graphs";
import { actionDrag } from "../canvas/action-drag";
import type { NewAction } from "../graph/edit";
import { type KnownAction, signature } from "./known-actions";
import style from "./sidebar.module.css";

function About({ known }: { known: KnownAction }) {
  const graphs = useGraphs().data ?? [];
  const { template, usedIn, takes, gives } = known;
  return (
    <Menu position="right-start" width={270}>
      <Menu.Target>
        <ActionIcon size={28} className={style.about ?? ""} aria-label={`About ${template.name}`}>
          <IconInfoCircle size={15} aria-hidden />
        </ActionIcon>
      </Menu.Target>
      <Menu.Dropdown>
        <div className={style.facts}>
          <p>{template.description || "Nobody has described it yet."}</p>
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

interface Props {
  known: KnownAction;
  onPlace: (template: NewAction) => void;
}

export function ActionRow({ known, onPlace }: Props) {
  const { template, usedIn } = known;
  return (
    <div className={style.action}>
      <button
        type="button"
        className={style.row}
        title={template.description || template.name}
        onPointerDown={(event) => actionDrag.press(event, template, template.name)}
        onClick={() => onPlace(template)}
      >
        <span className={style.grip} aria-hidden>
          <IconGripVertical size={14} />
        </span>
        <span className={style.text}>
          <span className={style.name}>{template.name}</span>
          <span className={style.sub}>
            {signature(template)}
            {usedIn.length > 0 && ` · used in ${usedIn.length}`}
          </span>
        </span>
      </button>
      {usedIn.length > 0 && <About known={known} />}
    </div>
  );
}
