"""Locks of work in the Postgres database that several editors share."""

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Final

from sqlalchemy import text

from action_assistant.errors import Unavailable
from action_assistant.journal.database import cause_of
from action_assistant.journal.postgres import Postgres, beside

_AT_ONCE: Final = 3
_PATIENCE_S: Final = 60.0
_LOCK: Final = text("SELECT pg_advisory_xact_lock(hashtextextended(:work, 46))")


class DatabaseLocks:
    """Locks in the Postgres database with the URL `database`. A lock is released when its process
    ends."""

    def __init__(self, database: str) -> None:
        self._engine = beside(database, "locks", size=_AT_ONCE, patience=_PATIENCE_S)

    @asynccontextmanager
    async def exclusively(self, work: str) -> AsyncIterator[None]:
        """Return a context in which no other editor does this work. Raise Unavailable if the
        database does not answer, or others take too long."""
        connection = self._engine.connect()
        try:
            await connection.start()
            await connection.execute(_LOCK, {"work": work})
        except Postgres.faults as error:
            await connection.close()
            raise Unavailable(f"Other editors cannot be asked: {cause_of(error)}.") from error
        try:
            yield
        finally:
            await connection.close()

    async def aclose(self) -> None:
        """Close the connections to the database."""
        await self._engine.dispose()
