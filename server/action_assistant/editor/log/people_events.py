"""The events of persons with personal links, and of groups: kinds, bodies, tables they fold into.

They are in the stream `people`, beside the names of everybody who has acted.
"""

from collections.abc import Callable, Sequence
from typing import Any, Final, TypeVar

import msgspec
from sqlalchemy import Executable, delete, insert, update

from action_assistant.journal.events import Event
from action_assistant.schema import editor_tables
from action_assistant.web.auth.roles import Role

ADDED: Final = "member.added.v1"
CHANGED: Final = "member.changed.v1"
CAME: Final = "member.came.v1"
RENEWED: Final = "member.renewed.v1"
REFUSED: Final = "member.refused.v1"
ENDED: Final = "member.ended.v1"
LINKED: Final = "link.made.v1"
LINK_USED: Final = "link.used.v1"
LINK_WITHDRAWN: Final = "link.withdrawn.v1"
DEVICE_ADDED: Final = "device.added.v1"
GROUP_MADE: Final = "group.made.v1"
GROUP_RENAMED: Final = "group.renamed.v1"
GROUP_REMOVED: Final = "group.removed.v1"

T = TypeVar("T")


class ProviderRecord(msgspec.Struct, frozen=True):
    """The person as their OpenID Connect provider called them at their last sign-in: the name, the
    role that its groups give there, and the groups here (ids) that they give. `lowered`: the role
    that an owner gave instead, which is lower and stays so; None where none did. `refused`: no group let
    them in when they came last, which was their last day; `until`: the last day before that, in
    microseconds since 1970; None for none."""

    issuer: str
    subject: str
    name: str
    role: Role
    groups: tuple[str, ...] = ()
    lowered: Role | None = None
    refused: bool = False
    until: int | None = None


class MemberState(msgspec.Struct, frozen=True):
    """A person was added, or has this name, role and groups from now on. `until`: microseconds
    since 1970. `provider`: None for a person who came by a personal link only."""

    id: str
    name: str
    role: Role
    groups: tuple[str, ...] = ()
    until: int | None = None
    provider: ProviderRecord | None = None


class MemberEnded(msgspec.Struct, frozen=True):
    """A person was ended: no session, token or link of theirs opens anything."""

    id: str


class LinkMade(msgspec.Struct, frozen=True):
    """A personal link was made. `expires`: microseconds since 1970."""

    id: str
    person: str
    expires: int


class LinkUsed(msgspec.Struct, frozen=True):
    """The author of the event, for whom the link was made, came in by it."""

    id: str
    browser: str
    address: str


class LinkWithdrawn(msgspec.Struct, frozen=True):
    """A personal link opens nothing from now on, since another one was made or its person ended."""

    id: str


class DeviceAdded(msgspec.Struct, frozen=True):
    """The author of the event has confirmed one more browser of theirs."""

    session: str
    browser: str
    address: str


class GroupState(msgspec.Struct, frozen=True):
    """A group was made, or has this name from now on."""

    id: str
    name: str


class GroupRemoved(msgspec.Struct, frozen=True):
    """A group was removed. Persons that were in it have changed by events of their own."""

    id: str


def fold(event: Event, read: Callable[[Event, type[Any]], Any]) -> Sequence[Executable]:
    """Return the statements by which an event about persons, links or groups changes the tables;
    none for events of other kinds. `read` decodes the body of an event."""
    match event.kind:
        case (
            "member.added.v1"
            | "member.changed.v1"
            | "member.came.v1"
            | "member.renewed.v1"
            | "member.refused.v1"
            | "member.ended.v1"
        ):
            return _member(event, read)
        case "link.made.v1" | "link.used.v1" | "link.withdrawn.v1":
            return _link(event, read)
        case "group.made.v1" | "group.renamed.v1" | "group.removed.v1":
            return _group(event, read)
        case _:
            return ()


def _member(event: Event, read: Callable[[Event, type[Any]], Any]) -> Sequence[Executable]:
    table = editor_tables.member
    if event.kind == ENDED:
        gone = update(table).where(table.c.id == read(event, MemberEnded).id)
        return [gone.values(ended_at=event.at, ended_by=event.author)]
    state: MemberState = read(event, MemberState)
    known = state.provider
    provider = None if known is None else msgspec.json.encode(known).decode()
    row: dict[str, Any] = {
        "name": state.name,
        "role": state.role,
        "groups": msgspec.json.encode(state.groups).decode(),
        "until": state.until,
        "provider": provider,
    }
    if event.kind in {ADDED, CAME}:
        new = {"id": state.id, "made_at": event.at, "made_by": event.author}
        return [insert(table).values(row | new)]
    return [update(table).where(table.c.id == state.id).values(row)]


def _link(event: Event, read: Callable[[Event, type[Any]], Any]) -> Sequence[Executable]:
    table = editor_tables.personal_link
    if event.kind == LINKED:
        made: LinkMade = read(event, LinkMade)
        row = {
            "id": made.id,
            "person": made.person,
            "made_at": event.at,
            "made_by": event.author,
            "expires": made.expires,
        }
        return [insert(table).values(row)]
    if event.kind == LINK_WITHDRAWN:
        this = update(table).where(table.c.id == read(event, LinkWithdrawn).id)
        return [this.values(withdrawn_at=event.at)]
    used: LinkUsed = read(event, LinkUsed)
    this = update(table).where(table.c.id == used.id)
    return [this.values(used_at=event.at, browser=used.browser, address=used.address)]


def _group(event: Event, read: Callable[[Event, type[Any]], Any]) -> Sequence[Executable]:
    table = editor_tables.people_group
    if event.kind == GROUP_REMOVED:
        return [delete(table).where(table.c.id == read(event, GroupRemoved).id)]
    state: GroupState = read(event, GroupState)
    if event.kind == GROUP_RENAMED:
        return [update(table).where(table.c.id == state.id).values(name=state.name)]
    row = {"id": state.id, "name": state.name, "made_at": event.at, "made_by": event.author}
    return [insert(table).values(row)]
