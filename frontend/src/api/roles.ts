/** What each role may do, as the server's own table has it (`web/auth/roles.py`); a test compares them. */

import type { EditorApi } from "./schema/editor";

export type Role = EditorApi["Person"]["role"];

/** From the least to the most; each may do what those before it may. */
const ROLES = ["viewer", "editor", "operator", "owner"] as const satisfies readonly Role[];

/** The least role that may do a thing. */
const FROM = {
  see: "viewer",
  stop: "viewer",
  edit: "editor",
  simulate: "editor",
  operate: "operator",
  register: "operator",
  share: "owner",
  restore: "owner",
} as const satisfies Record<string, Role>;

export type Permission = keyof typeof FROM;

export function may(role: Role, permission: Permission): boolean {
  return ROLES.indexOf(role) >= ROLES.indexOf(FROM[permission]);
}

/** What a role may do, to follow "may". */
export const ROLE_WORDS: Readonly<Record<Role, string>> = {
  viewer: "look at everything and stop runs",
  editor: "edit graphs, run them in the simulator, and stop runs",
  operator: "edit graphs, run them on robots, and stop runs",
  owner: "do everything",
};
