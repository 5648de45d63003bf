"""Restores a graph or one action of it, or reverts the edits of one person; each by a new edit."""

from typing import Final

import msgspec

from action_assistant.editor.catalogue import server_edits
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.reverting import one_as_it_was, reverting_edits
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.errors import BadInput, Conflict, NotFound
from action_assistant.journal.journal import Journal
from action_assistant.web.workers.lanes import RunInWorker, run_here

_MOST: Final = 100_000  # changes of keys that are taken back at once


class EditsOfOne(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A request to revert what one person, given by id, changed from the change `from_seq` to `seq`."""

    author: str
    from_seq: int
    seq: int


class GoneBack(msgspec.Struct, frozen=True):
    """The result of going back. `seq`: the last change of the graph now. `left`: keys of actions, notes and
    arrows that were not fully reverted, since others have changed them or built on them."""

    seq: int
    left: tuple[str, ...] = ()


class Restoring:
    """Makes the edits, and says in the log what they are."""

    def __init__(
        self,
        journal: Journal,
        rooms: Rooms,
        graph_reader: GraphReader,
        index: ChangeIndex,
        run_in_worker: RunInWorker = run_here,
    ) -> None:
        self._journal = journal
        self._rooms = rooms
        self._graph_reader = graph_reader
        self._index = index
        self._run_in_worker = run_in_worker

    async def restore(self, graph: str, author: str, seq: int) -> GoneBack:
        """Make a graph what it was after its change `seq`. Raises NotFound, Conflict, Unavailable."""
        then = await self._graph_reader.at(graph, seq)
        async with self._rooms.enter(h.graph_stream(graph)) as room:
            before = room.seq
            now = await server_edits.restore(
                room, author, then.state, run_in_worker=self._run_in_worker
            )
        return await self._said(graph, author, before, seq, now)

    async def restore_one(self, graph: str, author: str, seq: int, owner: str) -> GoneBack:
        """Make one action, arrow or note what it was after the change `seq`. Raises NotFound, Conflict,
        Unavailable."""
        upto = await self._index.upto(graph)
        if not 1 <= seq <= upto:
            raise Conflict(
                f"This graph has the changes 1 to {upto}; there is no {seq}.",
                where={"path": "/seq"},
            )
        async with self._rooms.enter(h.graph_stream(graph)) as room:
            before, state = room.seq, await _state(room)
            update = await self._index.value(one_as_it_was, graph, state, seq, owner)
            now = await room.submit(update, author)
        return await self._said(graph, author, before, seq, now)

    async def revert(self, graph: str, author: str, edits: EditsOfOne) -> GoneBack:
        """Take back what somebody did. Raises BadInput, NotFound, TooLarge, Unavailable."""
        first, last = edits.from_seq, edits.seq
        if not 2 <= first <= last:
            raise BadInput(
                "What a graph began with cannot be taken back, and nothing ends before it begins.",
                where={"path": "/from_seq"},
            )
        async with self._rooms.enter(h.graph_stream(graph)) as room:
            before, state = room.seq, await _state(room)
            upto = await self._index.upto(graph)  # with whatever that state holds
            found = await self._index.value(
                reverting_edits, graph, state, edits.author, first, min(last, upto), _MOST
            )
            if found is None:
                raise NotFound("This person changed nothing then.")
            now = await room.submit(found.update, author)
        if now > before:
            body = h.GraphReverted(edits.author, first, last, now)
            await self._journal.append(h.about_stream(graph), [h.draft(h.REVERTED, author, body)])
        return GoneBack(now, found.left)

    async def _said(self, graph: str, author: str, before: int, then: int, now: int) -> GoneBack:
        if now > before:
            restored = h.draft(h.RESTORED, author, h.GraphRestored(then, now))
            await self._journal.append(h.about_stream(graph), [restored])
        return GoneBack(now)


async def _state(room: Room) -> bytes:
    return await room.read(lambda replica, _: replica.state())
