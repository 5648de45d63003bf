"""Links by which people come in without the token: made, used, revoked.

A link carries the id of an invitation and its secret. The secret follows from the id and the token
(`Keys.secret_of`), so that neither the log nor a backup of it lets anybody in.
"""

import hmac
import logging
from datetime import datetime
from typing import Any, Final

import msgspec
from sqlalchemy import select

from action_assistant.editor import happenings as h
from action_assistant.editor.document import new_aid
from action_assistant.editor.people import People
from action_assistant.errors import BadInput, Conflict, NotFound, Unauthenticated, Withdrawn
from action_assistant.journal import tables
from action_assistant.journal.journal import Journal
from action_assistant.web.keys import Author, Keys
from action_assistant.web.revoked import Revoked
from action_assistant.web.roles import OWNER, Role
from action_assistant.web.sessions import Invited

log: Final = logging.getLogger(__name__)

LABEL_LIMIT: Final = 60  # characters
_MOST: Final = 200  # that are open at a time


class Guest(msgspec.Struct, frozen=True):
    """Somebody who came in by an invitation, and when that was first."""

    person: Author
    at: datetime


class Invitation(msgspec.Struct, frozen=True, omit_defaults=True, kw_only=True):
    """A link as its maker sees it. `path` follows the origin of the page; it holds the secret, and
    is left out once the link is revoked."""

    id: str
    role: Role
    label: str
    made_at: datetime
    made_by: Author
    guests: list[Guest]
    path: str | None = None
    revoked_at: datetime | None = None
    revoked_by: Author | None = None


class Invitations:
    """All that were ever made."""

    def __init__(self, journal: Journal, people: People, keys: Keys, revoked: Revoked) -> None:
        self._journal = journal
        self._people = people
        self._keys = keys
        self._revoked = revoked

    async def agree(self) -> None:
        """Make log and folder say the same: either may be older, of a backup or after a crash.
        What one of them calls revoked is revoked."""
        marked = self._revoked.every()
        for row in await self._journal.query(select(tables.invitation)):
            if row.revoked_at is not None:
                self._revoked.add(row.id)
            elif row.id in marked:
                await self._append(h.REVOKED, h.SERVER, h.RevokedInvitation(row.id))

    async def all(self) -> list[Invitation]:
        """Every one, the newest first."""
        chosen = select(tables.invitation).order_by(tables.invitation.c.made_at.desc())
        guests: dict[str, list[Guest]] = {}
        for each in await self._journal.query(select(tables.guest).order_by(tables.guest.c.at)):
            person = self._people.person(each.person)
            if not person.name:
                person = Author(each.person, each.name)
            guests.setdefault(each.invitation, []).append(Guest(person, h.when(each.at)))
        rows = await self._journal.query(chosen)
        return [self._view(row, guests.get(row.id, [])) for row in rows]

    async def make(self, role: Role, label: str, author: str) -> Invitation:
        """A new link. Raises BadInput, Conflict."""
        label = " ".join(label.split())
        if role == OWNER:
            raise BadInput("Owners come in by the token.", where={"path": "/role"})
        if len(label) > LABEL_LIMIT:
            raise BadInput(f"A label has up to {LABEL_LIMIT} characters.", where={"path": "/label"})
        if sum(each.revoked_at is None for each in await self.all()) >= _MOST:
            raise Conflict(f"There are {_MOST} links already; revoke some.")
        made = new_aid()
        await self._append(h.INVITED, author, h.MadeInvitation(made, role, label))
        return await self.get(made)

    async def get(self, invitation: str) -> Invitation:
        """One of them. Raises NotFound."""
        for each in await self.all():
            if each.id == invitation:
                return each
        raise NotFound(f"There is no invitation {invitation!r}.")

    async def revoke(self, invitation: str, author: str) -> Invitation:
        """End a link and every session that came in by it, at once and for good. Raises NotFound,
        Unavailable; then it may be tried again."""
        if (await self.get(invitation)).revoked_at is None:
            await self._append(h.REVOKED, author, h.RevokedInvitation(invitation))
        self._revoked.add(invitation)
        log.info("invitation %s is revoked", invitation)
        return await self.get(invitation)

    async def look(self, proof: str) -> Invited:
        """What a link invites to. Raises Unauthenticated, Withdrawn."""
        invitation, _, secret = proof.partition(".")
        expected = self._keys.secret_of(invitation)
        if not hmac.compare_digest(secret.encode(errors="replace"), expected.encode()):
            raise Unauthenticated("This link is of another server, or was cut short.")
        row = await self._row(invitation)
        if row is None:  # made after the backup that was restored
            raise Unauthenticated("This link is not known here any more. Ask for another one.")
        if row.revoked_at is not None or self._revoked.holds(invitation):
            raise Withdrawn("This link was revoked. Ask for another one.")
        return Invited(invitation, row.role, self._people.person(row.made_by).name)

    async def welcome(self, invitation: str, person: Author) -> None:
        """Somebody comes in: remember who, and by which link."""
        known = select(tables.guest).where(
            tables.guest.c.invitation == invitation, tables.guest.c.person == person.id
        )
        if not await self._journal.query(known):
            used = h.AcceptedInvitation(invitation, person.name)
            await self._append(h.ACCEPTED, person.id, used)

    async def _append(self, kind: str, author: str, body: msgspec.Struct) -> None:
        await self._journal.append(h.INVITATIONS, [h.draft(kind, author, body)])

    async def _row(self, invitation: str) -> Any:
        chosen = select(tables.invitation).where(tables.invitation.c.id == invitation)
        rows = await self._journal.query(chosen)
        return rows[0] if rows else None

    def _view(self, row: Any, guests: list[Guest]) -> Invitation:
        over = row.revoked_at is not None
        return Invitation(
            id=row.id,
            role=row.role,
            label=row.label,
            made_at=h.when(row.made_at),
            made_by=self._people.person(row.made_by),
            guests=guests,
            path=None if over else f"/#i={row.id}.{self._keys.secret_of(row.id)}",
            revoked_at=h.when(row.revoked_at) if over else None,
            revoked_by=self._people.person(row.revoked_by) if over else None,
        )
