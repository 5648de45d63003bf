"""The rooms that are open. Each is loaded once, kept while somebody uses it, and unloaded some
seconds later."""

import asyncio
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import asynccontextmanager, contextmanager
from typing import TYPE_CHECKING, Final

from action_assistant.editor.cluster.owners import Alone, Elsewhere, Here, Nobody, Owner, Owners
from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.loading import load
from action_assistant.editor.log.graph_events import graph_of
from action_assistant.editor.rooms.batch import LONGEST, BatchWindow
from action_assistant.editor.rooms.room import Room, RoomMetrics
from action_assistant.errors import NotFound, Unavailable
from action_assistant.journal.journal import Journal
from action_assistant.web.auth.caller import outlive_connection
from action_assistant.web.auth.identity import Identity
from action_assistant.web.auth.keys import PersonRef
from action_assistant.web.workers.lanes import RunInWorker, run_here

if TYPE_CHECKING:  # slow to load, and one editor alone does without
    from action_assistant.editor.cluster.peers import Peers
    from action_assistant.editor.rooms.remote_room import AnyRoom

LINGER: Final = 5.0  # seconds that a room stays after the last one left
_TICK: Final = 2.0  # seconds
_ANNOUNCEMENT_WINDOWS: Final = 10  # between two announcements of the sequence number
_ELSEWHERE: Final = "Another editor has this graph open; try again."
_PATIENCE_S: Final = 1.0  # with a room that another editor is to take
_SILENCE: Final = 10.0  # seconds without a message after which a socket is sent a heartbeat


class Rooms:
    """Opens and unloads the rooms of this process, by stream. `run_in_worker` runs work that grows
    with a document; `tried` runs trials of large updates before a room applies them. `owners` says
    which streams this editor owns, and `peers` leads to the others; None for the only editor of its
    database."""

    def __init__(
        self,
        journal: Journal,
        *,
        linger: float = LINGER,
        window: float = LONGEST,
        run_in_worker: RunInWorker = run_here,
        tried: RunInWorker = run_here,
        owners: Owners | None = None,
        peers: "Peers | None" = None,
    ) -> None:
        self._journal = journal
        self._owners: Final[Owners] = owners or Alone()
        self._peers = peers
        self._owners.when_lost(self._lose)
        self._run_in_worker = run_in_worker
        self._tried = tried
        self._window = BatchWindow(window)
        self._announcement_interval = _ANNOUNCEMENT_WINDOWS * window
        self._linger = linger
        self._rooms: dict[str, Room] = {}
        self._loading: dict[str, asyncio.Task[Room]] = {}
        self._holders: dict[str, int] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._timers: dict[str, asyncio.TimerHandle] = {}
        self._deleted: set[str] = set()  # while this process owned them
        #: Streams that this editor owns, at least those without an open room.
        self._taken: set[str] = set()
        self._closed = self._draining = False
        self._divergences = 0
        #: The people in rooms of other editors, by stream, as of half a second ago.
        self.people_elsewhere: Mapping[str, tuple[PersonRef, ...]] = {}
        self.metrics: Final = RoomMetrics()
        self._heartbeat = asyncio.create_task(self._send_heartbeats(), name="heartbeat")

    @asynccontextmanager
    async def enter(self, stream: str) -> AsyncIterator[Room]:
        """Return a context with the room of a stream, which is loaded if needed and stays loaded
        during it. Raise Unavailable if it cannot be loaded, or if another editor owns the stream,
        NotFound if several editors share the database and it has no such stream."""
        with self._held(stream):
            yield await self._room(stream)

    @asynccontextmanager
    async def reach(self, stream: str) -> AsyncIterator["AnyRoom"]:
        """Return a context with the room of a stream for edits of the server itself, wherever it is
        open. Raise Unavailable if it cannot be loaded or its editor does not answer."""
        with self._held(stream):
            if self._peers is None or not isinstance(await self._owners.owner(stream), Elsewhere):
                yield await self._room(stream)
                return
        from action_assistant.editor.rooms.remote_room import RemoteRoom

        yield RemoteRoom(stream, self._peers)

    @asynccontextmanager
    async def owned(self, stream: str) -> AsyncIterator[Owner]:
        """Return a context with the owner of a stream. If that is this editor, it stays the owner
        during it and for some seconds, of other streams than graphs until it ends, unless another
        one takes the stream. Raise Unavailable as `Owners` does."""
        with self._held(stream):
            owner = await self._owners.owner(stream)
            if isinstance(owner, Here):
                if graph_of(stream) is not None:
                    self._taken.add(stream)
                yield owner
                return
        yield owner

    @contextmanager
    def _held(self, stream: str) -> Iterator[None]:
        """Keep the room of a stream open, if it is, and own the stream, if this editor does."""
        self._holders[stream] = self._holders.get(stream, 0) + 1
        timer = self._timers.pop(stream, None)
        if timer is not None:
            timer.cancel()
        try:
            yield
        finally:
            self._holders[stream] -= 1
            if self._holders[stream] == 0:
                del self._holders[stream]
                self._unload_later(stream)

    def open_room(self, stream: str) -> Room | None:
        """Return the room of a stream if it is open; None otherwise."""
        return self._rooms.get(stream)

    def open_rooms(self) -> list[Room]:
        """Return all rooms that are open now."""
        return list(self._rooms.values())

    def people_here(self) -> dict[str, tuple[PersonRef, ...]]:
        """Return who is in the rooms of this editor, by stream."""
        return {room.stream: room.presence.people() for room in self.open_rooms()}

    def people_in(self, stream: str) -> tuple[PersonRef, ...]:
        """Return who is in the graph of a stream now, at whichever editor it is open."""
        room = self._rooms.get(stream)
        return self.people_elsewhere.get(stream, ()) if room is None else room.presence.people()

    @property
    def divergences(self) -> int:
        """The number of pages that showed something else than their room, since this process
        began."""
        return self._divergences + sum(room.comparisons.divergences for room in self.open_rooms())

    def is_joined(self, stream: str) -> bool:
        """Return whether the graph of this stream certainly exists, without a query: sockets are in
        its room, and no deletion has begun."""
        room = self._rooms.get(stream)
        return room is not None and bool(room.members) and room.graph_exists

    def check_existence(self, stream: str) -> None:
        """Forget that the graph of this stream exists, because it may be deleted soon: from now
        on, `is_joined` returns False for it, and its callers ask the database. Nothing is asked
        here."""
        room = self._rooms.get(stream)
        if room is not None:
            room.graph_exists = False

    def expel(self, stream: str) -> None:
        """Close all sockets of the graph with this stream, which was deleted. Sockets that are
        still being opened are closed, too."""
        self._deleted.add(stream)
        self.check_existence(stream)
        room = self._rooms.get(stream)
        for member in list(room.members) if room is not None else []:
            member.close(messages.NO_SUCH_GRAPH)

    def put_out(
        self,
        stream: str,
        may_see: Callable[[Identity], bool],
        may_edit: Callable[[Identity], bool],
    ) -> None:
        """Close the sockets of those who may no longer see the graph with this stream. The sockets
        of those who may no longer edit it are closed so that they come back as viewers."""
        room = self._rooms.get(stream)
        for member in list(room.members) if room is not None else []:
            if member.identity is None:
                continue
            if not may_see(member.identity):
                member.close(messages.NO_SUCH_GRAPH)
            elif member.edits and not may_edit(member.identity):
                member.close(messages.RESTARTING)

    def readmit(self, stream: str) -> None:
        """Admit sockets to the graph of this stream again, since it was recovered."""
        self._deleted.discard(stream)

    def is_deleted(self, stream: str) -> bool:
        """Return whether the graph of this stream was deleted since this process began, and not
        recovered."""
        return stream in self._deleted

    async def drain(self) -> None:
        """Let other editors take the rooms, those with the fewest people first. Each is closed with
        1012 when all that was sent to it is stored."""
        self._draining = True
        await self._owners.drain()
        for room in sorted(self.open_rooms(), key=lambda each: len(each.members)):
            try:
                async with asyncio.timeout(_PATIENCE_S):
                    await room.close_if_unused(lambda: False)
            except TimeoutError:  # its people send again what was not acknowledged
                room.end()
            await self._owners.give_up(room.stream)

    async def close(self) -> None:
        """Wait until every room has finished its work, and unload all rooms."""
        self._closed = True
        self._heartbeat.cancel()
        for timer in self._timers.values():
            timer.cancel()
        await asyncio.gather(*self._loading.values(), return_exceptions=True)
        await asyncio.gather(*(room.close_if_unused(lambda: False) for room in self.open_rooms()))
        if self._tasks:
            await asyncio.wait(self._tasks)

    async def _send_heartbeats(self) -> None:
        while True:
            await asyncio.sleep(_TICK)
            for room in self.open_rooms():
                for member in room.members:
                    member.send_heartbeat(_SILENCE)

    async def _room(self, stream: str) -> Room:
        room = self._rooms.get(stream)
        if room is not None:
            return room
        if self._closed or self._draining:
            raise Unavailable("The server is ending.")
        loading = self._loading.get(stream)
        if loading is None:
            loading = self._loading[stream] = asyncio.create_task(self._load(stream))
        return await asyncio.shield(loading)  # others may wait for it too

    async def _load(self, stream: str) -> Room:
        outlive_connection()  # others may wait for it, even if the first caller has left
        try:
            owner = await self._owners.owner(stream)
            if isinstance(owner, Elsewhere):
                raise Unavailable(_ELSEWHERE)
            if isinstance(owner, Nobody):
                raise NotFound(f"There is no graph {graph_of(stream)!r}.")
            loaded = await load(self._journal, stream, run_in_worker=self._run_in_worker)
            room = self._rooms[stream] = Room(
                stream,
                self._journal,
                loaded,
                self._forget,
                self._window,
                self._announcement_interval,
                self._run_in_worker,
                self._tried,
                self.metrics,
                owner.epoch,
            )
            self.metrics.opened += 1
            if stream not in self._holders:  # the socket had left before it was loaded
                self._unload_later(stream)
            return room
        finally:
            del self._loading[stream]

    def _unload_later(self, stream: str) -> None:
        """Unload the room of this stream after some seconds, unless it is used again."""
        if (stream in self._rooms or stream in self._taken) and not self._closed:
            loop = asyncio.get_running_loop()
            self._timers[stream] = loop.call_later(self._linger, self._unload, stream)

    def _lose(self, stream: str) -> None:
        """End the room of a stream at once, since another editor owns it now. What its clients have
        sent and was not acknowledged they send again, to that editor."""
        self._taken.discard(stream)
        self._deleted.discard(stream)
        room = self._rooms.get(stream)
        if room is not None:
            room.end()

    def _forget(self, room: Room) -> None:
        self._owners.check_again(room.stream)
        if self._rooms.get(room.stream) is room:
            del self._rooms[room.stream]
            self.metrics.unloaded += 1
            self._divergences += room.comparisons.divergences

    def _unload(self, stream: str) -> None:
        self._timers.pop(stream, None)
        task = asyncio.create_task(self._unloading(stream))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def _unloading(self, stream: str) -> None:
        room = self._rooms.get(stream)
        if room is not None:
            await room.close_if_unused(lambda: stream in self._holders)
        if not (stream in self._rooms or stream in self._loading or stream in self._holders):
            self._taken.discard(stream)
            self._deleted.discard(stream)
            await self._owners.give_up(stream)
