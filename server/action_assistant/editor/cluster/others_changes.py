"""Takes up what other editors have changed of people and rules, of which every editor keeps a copy in memory."""

import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Final

import anyio
from sqlalchemy import Connection, and_, or_, select

from action_assistant.editor.log import graph_events as h
from action_assistant.errors import Refused
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor, ends_of_slots, slot_of
from action_assistant.schema.editor_tables import editor_event

log: Final = logging.getLogger(__name__)

#: Reads a copy in memory again.
Refresh = Callable[[], Awaitable[object]]

_LOOK_S: Final = 0.5
_event = editor_event.c
_OF_RULES: Final = (h.RULED, h.FILED)


class OthersChanges:
    """Reads the events of all editors twice a second, and reads again what they have changed: `people` after
    changes of persons and links, `rules` after those of folders and rules."""

    def __init__(self, journal: Journal, people: Refresh, rules: Refresh) -> None:
        self._journal = journal
        # Rules come first: people wait for changes of persons that are being stored.
        self._refreshes = {"rules": rules, "people": people}
        self._due = set(self._refreshes)  # what was read before the cursor began
        self._seen = Cursor()

    @asynccontextmanager
    async def taken_up(self) -> AsyncIterator[None]:
        """Return a context during which changes are taken up."""
        self._seen, _ = await self._journal.ask(lambda connection: _news(connection, None))
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._keep_up)
            yield
            tasks.cancel_scope.cancel()

    async def _keep_up(self) -> None:
        while True:
            try:
                await self.look()
            except Refused as error:  # where nothing can be read, nothing can be changed, either
                log.warning("changes of other editors are not read: %s", error.detail)
            except (
                Exception
            ):  # a fault of this program must not end it: copies would grow old for good
                log.exception("changes of other editors cannot be read")
            await anyio.sleep(_LOOK_S)

    async def look(self) -> None:
        """Take up what was stored since the last call."""
        before = self._seen
        self._seen, changed = await self._journal.ask(lambda connection: _news(connection, before))
        self._due |= changed
        for kind, refresh in self._refreshes.items():
            if kind in self._due:
                await refresh()
                self._due.discard(kind)


def _news(connection: Connection, seen: Cursor | None) -> tuple[Cursor, set[str]]:
    """Return the present end of the log, and what was changed after the moment `seen` (None: nothing)."""
    ends = ends_of_slots(connection, _event.position)
    now = Cursor.at(ends)
    if seen is None or now == seen:
        return now, set()
    later = [
        and_(_event.position > seen.end_in(slot_of(end)), _event.position <= end)
        for end in ends
        if not seen.has(end)
    ]
    shared = or_(
        _event.stream.in_([h.PEOPLE, h.INVITATIONS, h.FOLDERS]), _event.kind.in_(_OF_RULES)
    )
    chosen = select(_event.stream).where(or_(*later), shared).distinct()
    streams = {row.stream for row in connection.execute(chosen)}
    of_people = streams & {h.PEOPLE, h.INVITATIONS}
    changed = {"people"} if of_people else set()
    if streams - of_people:
        changed.add("rules")
    return now, changed
