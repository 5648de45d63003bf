"""Tries, in a bounded time, whether a journal can be written and read now."""

from collections.abc import Awaitable, Callable
from typing import Any, Final, TypeAlias

from sqlalchemy import Connection, delete, insert, select

from action_assistant.errors import Unavailable
from action_assistant.journal.database import Branch
from action_assistant.journal.migrate import revisions_of
from action_assistant.kit.shared_check import SharedCheck
from action_assistant.schema.branches import VERSIONS
from action_assistant.schema.editor_tables import editor_snapshot

Asked: TypeAlias = Callable[[Callable[[Connection], Any]], Awaitable[Any]]

_PATIENCE_S: Final = 2.0
_FINE: Final = ""
#: A stream that nothing is ever stored in.
_NOTHING: Final = {"stream": "health", "seq": 0, "proof": b"", "state": b""}


class JournalProbe:
    """Tests a journal on request, once a second at most. `write` commits something on the writer's
    thread, `read` asks beside it; `is_alive` returns whether that thread lives."""

    def __init__(
        self, branch: Branch, write: Asked, read: Asked, is_alive: Callable[[], bool]
    ) -> None:
        self._expected = revisions_of(branch)[-1]
        self._is_alive = is_alive
        self._writing = SharedCheck(lambda: _tried(write, _leave_no_trace), patience=_PATIENCE_S)
        self._reading = SharedCheck(lambda: _tried(read, self._misfit), patience=_PATIENCE_S)

    async def parts(self) -> dict[str, str | None]:
        """Return for each part of the journal None if it works, else the reason."""
        parts: dict[str, str | None] = {"database": None, "writer": None, "schema": None}
        if not self._is_alive():
            parts["writer"] = (
                "The thread that writes the journal has ended: start this process anew."
            )
            return parts
        wrote = await self._writing.answer()
        read = await self._reading.answer()
        if wrote:
            parts["database"] = wrote
        elif read is None:
            parts["database"] = f"The database does not answer within {_PATIENCE_S:g} s."
        elif wrote is None:
            parts["writer"] = f"Nothing was stored within {_PATIENCE_S:g} s, though it can be read."
        elif read:
            parts["schema"] = read
        return parts

    def close(self) -> None:
        """Cancel the tests under way."""
        self._writing.cancel()
        self._reading.cancel()

    def _misfit(self, connection: Connection) -> str:
        found = set(connection.scalars(select(VERSIONS.c.version_num)))
        if self._expected in found:
            return _FINE
        other = ", ".join(sorted(found)) or "none"
        return f"The tables are of another version ({other}, not {self._expected})."


async def _tried(way: Asked, question: Callable[[Connection], Any]) -> str:
    """Return the reason why a question failed, or the text for success."""
    try:
        said: str | None = await way(question)
    except Unavailable as error:
        return error.detail
    return said or _FINE


def _leave_no_trace(connection: Connection) -> None:
    """Write and delete a row, so that the commit has to reach the disk as that of an edit does."""
    table = editor_snapshot
    connection.execute(insert(table).values(_NOTHING))
    connection.execute(delete(table).where(table.c.stream == _NOTHING["stream"]))
