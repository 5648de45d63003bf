"""Reads people and rules again after other editors changed them: each editor keeps a copy in
memory."""

import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Final

import anyio
from sqlalchemy import Connection, or_, select

from action_assistant.editor.log import graph_events as h
from action_assistant.errors import Refused
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor, is_between
from action_assistant.schema.editor_tables import editor_event

log: Final = logging.getLogger(__name__)

#: Reads a copy in memory again.
Refresh = Callable[[], Awaitable[object]]

_LOOK_S: Final = 0.5
_event = editor_event.c
_OF_RULES: Final = (h.RULED, h.FILED)


class OthersChanges:
    """Polls the log twice a second for changes by other editors. Calls `people` after changes of
    persons and links, `rules` after changes of folders and rules, and then `also`, whatever has
    changed."""

    def __init__(self, journal: Journal, people: Refresh, rules: Refresh, also: Refresh) -> None:
        self._journal = journal
        # Rules come first: people wait for changes of persons that are being stored.
        self._refreshes = {"rules": rules, "people": people}
        self._also = also
        self._due = set(self._refreshes)  # what was read before the cursor began
        self._seen = Cursor()

    @asynccontextmanager
    async def taken_up(self) -> AsyncIterator[None]:
        """Return a context during which the log is polled."""
        self._seen = await self._journal.cursor()
        async with anyio.create_task_group() as tasks:
            tasks.start_soon(self._keep_up)
            yield
            tasks.cancel_scope.cancel()

    async def _keep_up(self) -> None:
        while True:
            try:
                await self.look()
                await self._also()
            except Refused as error:  # where nothing can be read, nothing can be changed, either
                log.warning("changes of other editors are not read: %s", error.detail)
            # A fault of this program must not end the loop: the copies would stay old for good.
            except Exception:
                log.exception("changes of other editors cannot be read")
            await anyio.sleep(_LOOK_S)

    async def look(self) -> None:
        """Read again what was changed since the last call."""
        before, now = self._seen, await self._journal.cursor()
        if now != before:
            self._due |= await self._journal.ask(
                lambda connection: _changed(connection, before, now)
            )
            self._seen = now
        for kind, refresh in self._refreshes.items():
            if kind in self._due:
                await refresh()
                self._due.discard(kind)


def _changed(connection: Connection, seen: Cursor, now: Cursor) -> set[str]:
    """Return what was changed between two moments: `people`, `rules`, both or none."""
    shared = or_(
        _event.stream.in_([h.PEOPLE, h.INVITATIONS, h.FOLDERS]), _event.kind.in_(_OF_RULES)
    )
    chosen = select(_event.stream).where(is_between(_event.position, seen, now), shared).distinct()
    streams = {row.stream for row in connection.execute(chosen)}
    of_people = streams & {h.PEOPLE, h.INVITATIONS}
    changed = {"people"} if of_people else set()
    if streams - of_people:
        changed.add("rules")
    return changed
