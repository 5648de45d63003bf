"""Rules that say who may see and who may edit graphs, and how folders pass them on. Pure."""

from collections.abc import Mapping
from typing import Annotated, Final, Literal, NamedTuple, TypeAlias

import msgspec

from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.roles import OWNER

_Id: TypeAlias = Annotated[str, msgspec.Meta(pattern=r"^[A-Za-z0-9_-]{1,40}$")]
#: Everybody who is signed in, or the persons and the members of groups with these ids.
Who: TypeAlias = Literal["all"] | Annotated[tuple[_Id, ...], msgspec.Meta(max_length=200)]

MAY_NOT_EDIT: Final = "You may look at this graph, and not change it."


class Rule(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Names those who may see a graph, and those who may also edit it as far as their role allows.
    Editors may see it, too; with `editors` "all" everybody who may see it may edit it. Owners may do
    both."""

    readers: Who
    editors: Who


#: The rule of a graph for which nobody has made one, itself or by a folder.
OPEN: Final = Rule("all", "all")


class RuledFolder(NamedTuple):
    """A folder with its own rule, if any, and the folder in which it lies."""

    parent: str | None
    rule: Rule | None


def may_see(rule: Rule, identity: Identity) -> bool:
    """Return whether an identity may see a graph with this rule."""
    if identity.person.role == OWNER or _names(rule.readers, identity):
        return True
    return rule.editors != "all" and _names(rule.editors, identity)


def may_edit(rule: Rule, identity: Identity) -> bool:
    """Return whether a rule lets an identity edit a graph; the role has to allow it as well."""
    if identity.person.role == OWNER:
        return True
    return may_see(rule, identity) and _names(rule.editors, identity)


def rule_at(own: Rule | None, folder: str | None, folders: Mapping[str, RuledFolder]) -> Rule:
    """Return the rule that counts for a graph or folder with the rule `own` in `folder`: its own,
    else that of the nearest folder around it that has one."""
    passed: set[str] = set()
    while own is None and folder is not None and folder in folders and folder not in passed:
        passed.add(folder)
        folder, own = folders[folder]
    return OPEN if own is None else own


def _names(who: Who, identity: Identity) -> bool:
    return who == "all" or identity.person.id in who or not identity.groups.isdisjoint(who)
