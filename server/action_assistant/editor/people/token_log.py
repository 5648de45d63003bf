"""Stores in the log which tokens of programs were made and revoked, by whom.

Files and marks decide what a token opens; the log only tells. So a log that cannot be written keeps no
token from being revoked: it takes that up later.
"""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

import msgspec

from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people.late_records import LateRecords
from action_assistant.journal.journal import Journal
from action_assistant.web.auth.identity import Scope
from action_assistant.web.auth.tokens import TokenRecord

MADE: Final = "token.made.v1"
REVOKED: Final = "token.revoked.v1"
_STREAM: Final = "tokens"


class TokenMade(msgspec.Struct, frozen=True):
    """The author of the event made a token, or let a program in by a code. `expires`: microseconds
    since 1970."""

    id: str
    name: str
    scopes: tuple[Scope, ...]
    expires: int


class TokenRevoked(msgspec.Struct, frozen=True):
    """A token was revoked. `person`: the id of its maker."""

    id: str
    name: str
    person: str


class TokenLog:
    """Appends the events of tokens to the journal, now or later."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._late = LateRecords("the tokens of programs")

    @asynccontextmanager
    async def opened(self) -> AsyncIterator[None]:
        """Return a context for storing events. Those that are not stored at its end are given up."""
        try:
            yield
        finally:
            await self._late.aclose()

    async def made(self, record: TokenRecord) -> None:
        """Store that a token was made by its person."""
        body = TokenMade(record.id, record.name, record.scopes, int(record.expires * 1_000_000))
        await self._add(MADE, record.person.id, body)

    async def revoked(self, record: TokenRecord, author: str) -> None:
        """Store that a token was revoked by a person."""
        await self._add(REVOKED, author, TokenRevoked(record.id, record.name, record.person.id))

    async def _add(self, kind: str, author: str, body: msgspec.Struct) -> None:
        event = h.draft(kind, author, body)  # here: it takes up by which session it was asked

        async def store() -> None:
            await self._journal.append(_STREAM, [event])

        await self._late.add(store)
