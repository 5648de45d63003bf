"""Rules that say who may see and who may edit graphs, and how folders pass them on. Pure."""

from collections.abc import Callable, Iterable, Mapping
from typing import Annotated, Final, Literal, NamedTuple, TypeAlias

import msgspec

from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import Person
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
#: The rule of what cannot be judged: for owners only.
CLOSED: Final = Rule((), ())


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


def combined(rules: Iterable[Rule]) -> Rule:
    """Return a rule for what is made of several graphs with these rules: whoever it names may see,
    or edit, all of them."""
    every = tuple(rules)
    readers = _common(_all_readers(rule) for rule in every)
    editors = _common(
        _all_readers(rule) if rule.editors == "all" else rule.editors for rule in every
    )
    return Rule(readers, "all" if editors == readers else editors)


def with_person(rule: Rule, person: str) -> Rule:
    """Return a rule by which the person with the id `person` may edit, besides all who may edit by
    `rule`; `rule` itself if it allows that already."""
    named = Identity(Person(person, "", "editor"))
    if may_edit(rule, named) or rule.editors == "all" == rule.readers:
        return rule
    editors = rule.readers if rule.editors == "all" else rule.editors
    return Rule(rule.readers, (*(() if editors == "all" else editors), person))


def rule_words(rule: Rule, what: str, name_of: Callable[[str], str]) -> str:
    """Return a rule as sentences about `what`, "it" or "them". `name_of`: the name of a person or
    group, "" for one that is not known."""

    def listed(ids: tuple[str, ...]) -> str:
        called = [name_of(each) or f"somebody who was removed ({each})" for each in ids]
        head, last = ", ".join(called[:-1]), called[-1] if called else "owners"
        return f"{head} and {last}" if head else last

    readers, editors = rule.readers, rule.editors
    if readers == "all":
        if editors == "all":
            return f"Everybody may see and edit {what}."
        return f"Everybody may see {what}. Only {listed(editors)} may edit {what}."
    named = readers if editors == "all" else tuple(dict.fromkeys((*readers, *editors)))
    if not named:
        return f"Only owners may see {what}."
    if editors == "all" or set(named) <= set(editors):
        return f"Only {listed(named)} may see and edit {what}."
    return f"Only {listed(named)} may see {what}. Only {listed(editors)} may edit {what}."


def _all_readers(rule: Rule) -> Who:
    """Return everybody who may see a graph with this rule, beside owners."""
    if rule.readers == "all" or rule.editors == "all":
        return rule.readers
    return tuple(dict.fromkeys((*rule.readers, *rule.editors)))


def _common(whos: Iterable[Who]) -> Who:
    """Return who stands in all of these; not more, where a person stands in one and their group in
    another."""
    found: Who = "all"
    for who in whos:
        if found == "all":
            found = who
        elif who != "all":
            found = tuple(each for each in found if each in who)
    return found


def _names(who: Who, identity: Identity) -> bool:
    return who == "all" or identity.person.id in who or not identity.groups.isdisjoint(who)
