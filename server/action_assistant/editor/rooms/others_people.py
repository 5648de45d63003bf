"""Shows on lists who is in the graphs that other editors have open (decision 178).

Each editor writes beside the streams that it owns, in the table `room`, who is in their rooms, and reads what the
others have written. A row ends with the ownership, and counts only while its editor lives.
"""

from collections.abc import Mapping
from typing import Any, Final

import msgspec
from sqlalchemy import Connection, text

from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.errors import Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.journal.postgres import HELD_SLOT
from action_assistant.web.auth.keys import PersonRef

_ALIVE_US: Final = 2_000_000  # since the last beat of an editor that counts
#: Editors of the version before, which have no mark, leave there the people of whoever owned a stream before them.
_READ: Final = text(
    "SELECT r.stream, r.life, r.people, e.slot = :slot AS is_ours"
    " FROM room r JOIN editor e ON e.life = r.life"
    " WHERE e.slot = :slot OR (r.people IS NOT NULL AND e.mark IS NOT NULL AND e.beat_at >"
    f" (extract(epoch FROM clock_timestamp()) * 1000000)::bigint - {_ALIVE_US}"
    f" AND {HELD_SLOT.format('e.slot')})"
)
_WRITE: Final = text("UPDATE room SET people = :people WHERE stream = :stream AND life = :life")


class OthersPeople:
    """Keeps `rooms` up to date about the people in rooms of other editors, and these about its own."""

    def __init__(self, journal: Journal, rooms: Rooms) -> None:
        self._journal = journal
        self._rooms = rooms

    async def exchange(self) -> None:
        """Read what the others have written, and write what has changed here. Raise Unavailable if the
        database cannot be used; then nobody is known elsewhere."""
        slot = self._journal.slot
        try:
            rows = await self._journal.ask(
                lambda connection: connection.execute(_READ, {"slot": slot}).all()
            )
        except Unavailable:
            self._rooms.people_elsewhere = {}
            raise
        self._rooms.people_elsewhere = {
            row.stream: msgspec.json.decode(row.people, type=tuple[PersonRef, ...])
            for row in rows
            if not row.is_ours
        }
        here = _written(self._rooms.people_here())
        changed: list[dict[str, Any]] = [
            {"stream": row.stream, "life": row.life, "people": here.get(row.stream)}
            for row in rows
            if row.is_ours and row.people != here.get(row.stream)
        ]
        if changed:
            await self._journal.derive(lambda connection: _write(connection, changed))


def _written(people: Mapping[str, tuple[PersonRef, ...]]) -> dict[str, str]:
    """Return as JSON who is in which stream, without those in which nobody is."""
    return {stream: msgspec.json.encode(some).decode() for stream, some in people.items() if some}


def _write(connection: Connection, rows: list[dict[str, Any]]) -> None:
    connection.execute(_WRITE, rows)
