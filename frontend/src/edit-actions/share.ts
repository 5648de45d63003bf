/** Edit actions for the whole graph: export it, its C++ packages, its history, a link to it. */

import {
  IconDownload,
  IconHistory,
  IconLink,
  IconPackage,
  IconPhoto,
  IconPrinter,
} from "@tabler/icons-react";
import { copyLinkTo } from "./clipboard";
import type { EditAction } from "./edit-action";
import { selectedActions } from "./editor-context";
import { linkTo } from "./graph-links";

const graph = { group: "Graph", changes: false, enabled: () => true } as const;

export const exportUmrf: EditAction = {
  ...graph,
  name: "export",
  label: "Export as UMRF",
  shortcuts: ["Mod+s"],
  icon: IconDownload,
  also: "download save file JSON",
  run: (context) => context.download("umrf"),
};

export const exportSvg: EditAction = {
  ...graph,
  name: "export-svg",
  label: "Export as SVG",
  shortcuts: [],
  icon: IconPhoto,
  also: "picture image download vector",
  run: (context) => context.download("svg"),
};

export const exportPng: EditAction = {
  ...graph,
  name: "export-png",
  label: "Export as PNG",
  shortcuts: [],
  icon: IconPhoto,
  also: "picture image download",
  run: (context) => context.download("png"),
};

export const packages: EditAction = {
  ...graph,
  name: "packages",
  label: "C++ packages",
  shortcuts: [],
  icon: IconPackage,
  also: "generate code ROS colcon download source header CMake",
  enabled: (context) => context.graph.actions.some((action) => !action.missing),
  run: (context) => {
    const [first] = selectedActions(context);
    context.openOverlay({ kind: "packages", ...(first ? { action: first.name } : {}) });
  },
};

export const history: EditAction = {
  ...graph,
  name: "history",
  label: "What was done to this graph",
  shortcuts: [],
  icon: IconHistory,
  also: "history restore earlier version changes back",
  run: (context) => context.setPanel("history"),
};

export const print: EditAction = {
  ...graph,
  name: "print",
  label: "Print or PDF",
  shortcuts: [],
  icon: IconPrinter,
  also: "paper export",
  // After the menu is closed: what is printed is the page of that moment.
  run: () => void setTimeout(() => window.print(), 0),
};

export const copyLink: EditAction = {
  ...graph,
  name: "copy-link",
  label: "Copy link",
  shortcuts: ["Mod+Shift+l"],
  icon: IconLink,
  also: "share url address deep link",
  run: (context) => {
    void copyLinkTo(linkTo(context.id, [...context.selection]));
  },
};
