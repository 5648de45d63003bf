/** What draws the nodes and edges of a canvas. */
import type { EdgeTypes, NodeTypes } from "@xyflow/react";
import { ActionCard } from "./action-card";
import { EndPill } from "./end-pill";
import { NoteCard } from "./notes/note-card";
import { OutcomeArrow } from "./outcome-arrow";
import "@xyflow/react/dist/style.css";
import "./canvas.css";

export const nodeTypes: NodeTypes = { action: ActionCard, end: EndPill, note: NoteCard };
export const edgeTypes: EdgeTypes = { outcome: OutcomeArrow };
