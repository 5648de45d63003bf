/** Edit actions that open a panel, find or a dry-run. */
import { IconListTree, IconMessageCircle, IconSearch, IconShieldCheck } from "@tabler/icons-react";
import type { EditAction } from "./edit-action";

const look = { group: "Look", changes: false, enabled: () => true } as const;

export const PANELS: readonly EditAction[] = [
  {
    ...look,
    name: "find",
    label: "Find in graph",
    shortcuts: ["Mod+f"],
    icon: IconSearch,
    also: "search robot parameter value problem",
    enabled: (context) => context.graph.actions.length > 0,
    run: (context) => context.openFind(),
  },
  {
    ...look,
    name: "outline",
    label: "Show the outline",
    shortcuts: ["o"],
    icon: IconListTree,
    also: "tree list rows",
    run: (context) => context.setPanel("outline"),
  },
  {
    ...look,
    name: "comments",
    label: "Show the comments",
    shortcuts: ["m"],
    icon: IconMessageCircle,
    also: "talk threads",
    run: (context) => context.setPanel("comments"),
  },
  {
    ...look,
    name: "courses",
    label: "Show the expected courses",
    shortcuts: [],
    icon: IconShieldCheck,
    also: "tests coverage verify",
    run: (context) => context.setPanel("courses"),
  },
];
