"""Persons by an OpenID Connect provider: name, role and groups as it says at each sign-in."""

import hashlib
from collections.abc import Collection
from datetime import UTC, datetime
from typing import Final

import msgspec
from msgspec.structs import replace

from action_assistant.editor.log import people_events as e
from action_assistant.editor.people.members import Member, Members
from action_assistant.kit.moments import moment
from action_assistant.safe_text import is_name
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.auth.people_files import NAME_LIMIT, PersonFile
from action_assistant.web.auth.roles import Role, rank

_NUMBER: Final = 7  # characters that a number after a name takes at most


async def provided(
    members: Members, issuer: str, subject: str, name: str, role: Role, groups: Collection[str]
) -> PersonFile:
    """Return the person whom a provider calls `subject`, with name, role and groups as it says now.

    `role`: by the groups of the provider; a lower one that an owner gave stays. `groups`: names; the
    groups here with one of these names get the person, others that the provider gave before lose
    them. A name that an owner gave stays until the provider says another one. Raise Withdrawn if an
    owner has ended the person, Conflict if there are too many, Unavailable.
    """
    person = provided_id(issuer, subject)
    async with members.turn:
        members.refuse_ended(person)
        known, before = members.known(person)
        given = tuple(each.id for each in members.groups() if each.name in groups)
        lowered = None if before is None else before.lowered
        until = None if known is None else known.until
        if before is not None and before.refused:
            until = None if before.until is None else moment(before.until)
        record = e.ProviderRecord(issuer, subject, name, role, given, lowered)
        if lowered is not None and rank(lowered) < rank(role):
            role = lowered
        if known is None:
            members.refuse_more()
            new = Member(
                id=person,
                name=_free(members, name, person),
                role=role,
                groups=given,
                made_at=datetime.now(UTC),
                made_by=PersonRef(person, ""),
            )
            came = await members.store(e.CAME, person, new, record)
        else:
            is_renamed = before is None or before.name != name
            taken = () if before is None else before.groups
            own = tuple(each for each in known.groups if each not in taken)
            new = replace(
                known,
                name=_free(members, name, person) if is_renamed else known.name,
                role=role,
                groups=tuple(dict.fromkeys((*own, *given))),
                until=until,
            )
            came = await members.store(e.RENEWED, person, new, record)
        members.refuse_ended(person)  # they may have been ended meanwhile
        return came


async def refused(members: Members, issuer: str, subject: str) -> None:
    """Restrict a person to Stop, in all sessions and with all tokens, since none of their groups at
    the provider gives access any more. The restriction lasts until the provider admits them at a
    sign-in, or an owner sets another last day. Do nothing if the person is unknown or already
    restricted. Raise Unavailable if the restriction cannot be stored."""
    person = provided_id(issuer, subject)
    async with members.turn:
        known, before = members.known(person)
        if known is None or before is None or before.refused:
            return
        until = None if known.until is None else int(known.until.timestamp() * 1e6)
        over = replace(known, until=datetime.now(UTC))
        await members.store(e.REFUSED, person, over, replace(before, refused=True, until=until))


def provided_id(issuer: str, subject: str) -> str:
    """Return the id of the person whom a provider calls `subject`: always the same, so that the mark
    of an ended person holds without a log, and two sign-ins at once make one person."""
    digest = hashlib.sha256(msgspec.json.encode((issuer, subject))).hexdigest()
    return f"p{digest[:23]}"


def _free(members: Members, text: str, person: str) -> str:
    """Return the name that a provider says, as people may see it: one short line without control
    characters. A number follows if somebody else who is here has that name."""
    shown = "".join(each if is_name(f"x{each}") else " " for each in text)
    name = " ".join(shown.split())[:NAME_LIMIT].rstrip() or "Somebody"
    free, number = name, 1
    while members.has_name(free, but=person):
        number += 1
        free = f"{name[: NAME_LIMIT - _NUMBER]} ({number})"
    return free
