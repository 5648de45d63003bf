"""Invitation links, by which people come in without the token: made, used, revoked.

A link carries the id of an invitation and its secret. The secret follows from the id and the token
(`Keys.secret_of`), so that the log alone lets nobody in.
"""

import asyncio
import contextlib
import hmac
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import UTC, datetime
from typing import Final

import msgspec
from msgspec.structs import replace
from sqlalchemy import select

from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people.people import People
from action_assistant.errors import (
    BadInput,
    Conflict,
    NotFound,
    Unauthenticated,
    Unavailable,
    Withdrawn,
)
from action_assistant.journal.journal import Journal
from action_assistant.random_ids import random_id
from action_assistant.schema import editor_tables
from action_assistant.web.auth.keys import Keys, PersonRef
from action_assistant.web.auth.revocations import Revocations
from action_assistant.web.auth.roles import OWNER, Role
from action_assistant.web.auth.sessions import Invited

log: Final = logging.getLogger(__name__)

LABEL_LIMIT: Final = 60  # characters
_MOST: Final = 200  # that are open at a time
_PATIENCE_S: Final = 2.0  # that somebody waits for the log, who has revoked a link
_AGAIN_S: Final = 5.0


class Guest(msgspec.Struct, frozen=True):
    """A person who came in by an invitation. `at`: when that was for the first time."""

    person: PersonRef
    at: datetime


class Invitation(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A link as its maker sees it. `path` follows the origin of the page; it holds the secret, and
    is left out once the link is revoked. `unrecorded`: that it is revoked is not in the log yet."""

    id: str
    role: Role
    label: str
    made_at: datetime
    made_by: PersonRef
    guests: list[Guest]
    path: str | None = None
    revoked_at: datetime | None = None
    revoked_by: PersonRef | None = None
    unrecorded: bool = False


class Invitations:
    """All invitations ever made, held in memory, so that using and revoking one needs no database."""

    def __init__(self, journal: Journal, people: People, keys: Keys, revoked: Revocations) -> None:
        self._journal = journal
        self._people = people
        self._keys = keys
        self._revoked = revoked
        self._made: dict[str, Invitation] = {}
        self._unrecorded: list[tuple[str, PersonRef]] = []  # what was revoked, and by whom
        self._recording: asyncio.Task[None] | None = None

    @asynccontextmanager
    async def opened(self) -> AsyncIterator[None]:
        """Load all invitations; inside of the `async with`, store revocations that could not be
        stored at once. Log and folder are made equal, since either may be older after a restore
        or crash: an invitation that one of them calls revoked is revoked."""
        await self._read()
        marked = self._revoked.every()
        for each in tuple(self._made.values()):
            if each.revoked_at is None and each.id in marked:
                self._end(each, PersonRef(h.SERVER, ""))
            elif each.revoked_at is not None and each.id not in marked:
                try:
                    self._revoked.add(each.id)
                except Unavailable as error:
                    log.error("invitation %s: %s", each.id, error.detail)
        await self._recorded()
        try:
            yield
        finally:
            if self._recording is not None:
                self._recording.cancel()
                await asyncio.wait([self._recording])

    async def refresh(self) -> None:
        """Read all invitations again, since another editor may have changed some. What was revoked here and
        is not stored yet stays revoked. Raise Unavailable if the journal cannot be read."""
        await self._read()

    def all(self) -> list[Invitation]:
        """Return all invitations, newest first."""
        newest = sorted(self._made.values(), key=lambda each: each.made_at, reverse=True)
        return [self._view(each) for each in newest]

    async def make(self, role: Role, label: str, author: str) -> Invitation:
        """Make an invitation. Raise BadInput for a bad role or label, Conflict if there are too
        many, Unavailable if the journal cannot be written."""
        label = " ".join(label.split())
        if role == OWNER:
            raise BadInput("Owners come in by the token.", where={"path": "/role"})
        if len(label) > LABEL_LIMIT:
            raise BadInput(f"A label has up to {LABEL_LIMIT} characters.", where={"path": "/label"})
        if sum(each.revoked_at is None for each in self._made.values()) >= _MOST:
            raise Conflict(f"There are {_MOST} links already; revoke some.")
        made = random_id()
        await self._append(h.INVITED, author, h.MadeInvitation(made, role, label))
        await self._read(made)
        return self.get(made)

    def get(self, invitation: str) -> Invitation:
        """Return one invitation. Raise NotFound if there is none with this id."""
        return self._view(self._one(invitation))

    async def revoke(self, invitation: str, by: PersonRef) -> Invitation:
        """Revoke an invitation and end all sessions that came in by it, at once and for good. Raise
        NotFound if it does not exist; raise Unavailable if neither the journal nor the folder
        could store that, so that it holds only until this process ends."""
        link = self._one(invitation)
        if link.revoked_at is None:
            self._end(link, by)
        unwritten = None
        try:
            await asyncio.to_thread(self._revoked.add, invitation)
        except Unavailable as error:
            unwritten = error
        log.info("invitation %s is revoked", invitation)
        await self._recorded()
        if unwritten is not None and self._one(invitation).unrecorded:
            raise unwritten
        return self.get(invitation)

    def _one(self, invitation: str) -> Invitation:
        if invitation not in self._made:
            raise NotFound(f"There is no invitation {invitation!r}.")
        return self._made[invitation]

    def _end(self, link: Invitation, by: PersonRef) -> None:
        """Make an invitation invalid in memory, before the log has it."""
        self._made[link.id] = replace(
            link, revoked_at=datetime.now(UTC), revoked_by=by, unrecorded=True
        )
        self._unrecorded.append((link.id, by))

    async def _recorded(self) -> None:
        """Start to store the revocations in the log, and wait a short time for that."""
        if not self._unrecorded:
            return
        if self._recording is None or self._recording.done():
            self._recording = asyncio.create_task(self._record(), name="revocations")
        await asyncio.wait([self._recording], timeout=_PATIENCE_S)

    async def _record(self) -> None:
        """Store revocations in the log, and retry until all are stored."""
        told = False
        while self._unrecorded:
            invitation, by = self._unrecorded[0]
            try:
                if by.name:
                    await self._people.seen(by)
                await self._append(h.REVOKED, by.id, h.RevokedInvitation(invitation))
                when = select(editor_tables.invitation.c.revoked_at)
                row = await self._journal.query(
                    when.where(editor_tables.invitation.c.id == invitation)
                )
            except Unavailable as error:
                if not told:
                    log.warning(
                        "that %s is revoked is not in the log: %s", invitation, error.detail
                    )
                told = True
                await asyncio.sleep(_AGAIN_S)
                continue
            except (
                Exception
            ):  # the mark in the folder ends it; the next ones are stored all the same
                log.exception("the log cannot have that %s is revoked", invitation)
                self._unrecorded.pop(0)
                continue
            self._unrecorded.pop(0)
            self._made[invitation] = replace(
                self._made[invitation], unrecorded=False, revoked_at=h.when(row[0].revoked_at)
            )
        if told:
            log.info("the log says now what is revoked")
        with contextlib.suppress(Unavailable):  # told when it was tried first; the log has it now
            await asyncio.to_thread(self._revoked.write_again)

    def look(self, proof: str) -> Invited:
        """Return the role that a link gives, and who made it. Raise Unauthenticated if the link is
        not valid, Withdrawn if it was revoked."""
        invitation, _, secret = proof.partition(".")
        expected = self._keys.secret_of(invitation)
        if not hmac.compare_digest(secret.encode(errors="replace"), expected.encode()):
            raise Unauthenticated("This link is of another server, or was cut short.")
        link = self._made.get(invitation)
        if link is None:  # made after the backup that was restored
            raise Unauthenticated("This link is not known here any more. Ask for another one.")
        if link.revoked_at is not None or self._revoked.holds(invitation):
            raise Withdrawn("This link was revoked. Ask for another one.")
        return Invited(invitation, link.role, self._people.inviter(link.made_by.id))

    async def welcome(self, invitation: str, person: PersonRef) -> None:
        """Record the first time that a person comes in by an invitation. Raise Unavailable if the
        journal cannot be written."""
        guests = self._one(invitation).guests
        if any(each.person.id == person.id for each in guests):
            return
        await self._append(h.ACCEPTED, person.id, h.AcceptedInvitation(invitation, person.name))
        guest = editor_tables.guest.c
        mine = select(guest.at).where(guest.invitation == invitation, guest.person == person.id)
        (row,) = await self._journal.query(mine)
        if not any(each.person.id == person.id for each in guests):
            guests.append(Guest(PersonRef(person.id, person.name), h.when(row.at)))

    async def _append(self, kind: str, author: str, body: msgspec.Struct) -> None:
        await self._journal.append(h.INVITATIONS, [h.draft(kind, author, body)])

    async def _read(self, new: str | None = None) -> None:
        """Read the invitation with the id `new` from the tables into memory. Without an id, read
        all invitations and their guests."""
        which = select(editor_tables.invitation)
        if new is not None:
            which = which.where(editor_tables.invitation.c.id == new)
        rows = await self._journal.query(which)
        guest = editor_tables.guest
        came = await self._journal.query(select(guest).order_by(guest.c.at)) if new is None else []
        guests: dict[str, list[Guest]] = {}
        for each in came:
            person = Guest(PersonRef(each.person, each.name), h.when(each.at))
            guests.setdefault(each.invitation, []).append(person)
        for row in rows:
            over = row.revoked_at is not None
            known = self._made.get(row.id)
            if known is not None and known.unrecorded:
                continue
            self._made[row.id] = Invitation(
                id=row.id,
                role=row.role,
                label=row.label,
                made_at=h.when(row.made_at),
                made_by=PersonRef(row.made_by, ""),
                guests=guests.get(row.id, []),
                revoked_at=h.when(row.revoked_at) if over else None,
                revoked_by=PersonRef(row.revoked_by, "") if over else None,
            )

    def _view(self, link: Invitation) -> Invitation:
        """Return an invitation with the present names of people, and with its secret link unless it
        is revoked."""
        over = link.revoked_at is not None
        return replace(
            link,
            made_by=self._named(link.made_by),
            guests=[Guest(self._named(each.person), each.at) for each in link.guests],
            path=None if over else f"/#i={link.id}.{self._keys.secret_of(link.id)}",
            revoked_by=self._named(link.revoked_by) if link.revoked_by is not None else None,
        )

    def _named(self, person: PersonRef) -> PersonRef:
        now = self._people.person(person.id)
        return now if now.name else person
