"""Connections: how many there may be, for how long they may be silent, and who has to go first.

Descriptors are what a process has fewest of, and every connection takes one before it has said who
it is. So strangers get a share, the oldest of whoever holds most makes room for the next, and what
is left over is for those who are signed in, and for files.
"""

import asyncio
import contextlib
import logging
import os
import select
import socket
import ssl
import time
from collections.abc import Callable, Coroutine, Iterator
from itertools import islice
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from _typeshed import HasFileno

log: Final = logging.getLogger(__name__)

_KEPT: Final = 96  # descriptors for files, the database, workers and robots
_MOST: Final = 8_192  # connections; more would only cost memory
_MOST_STRANGERS: Final = 2_048
_SILENT_S: Final = 10.0  # until a request has come, with a handshake before it
_SWEEP_S: Final = 1.0
_AT_ONCE: Final = 50  # accepted between two turns of the loop
_LOOKED_AT: Final = 16  # oldest connections of a holder that are searched for an idle one
_PAUSE_S: Final = 0.05  # when the system has no descriptor left

Peer = tuple[str, int]
Factory = Callable[[], asyncio.Protocol]


class Connection:
    """An accepted connection. `holder`: the person who is signed in on it, else the client's
    address; behind a proxy it is unknown until the proxy names the client."""

    def __init__(self, wire: socket.socket, peer: Peer, *, of_proxy: bool = False) -> None:
        self.holder = f"@{peer[0]}:{peer[1]}" if of_proxy else f"@{peer[0]}"
        self.answering = 0  # requests that are being answered
        self.since = time.monotonic()  # when it began to wait for a request
        self.transport: asyncio.BaseTransport | None = None  # after the handshake
        self.is_silent = True  # nothing at all has come yet
        self._wire = wire

    @property
    def is_over(self) -> bool:
        """Return whether the connection's descriptor is free again."""
        return self._wire.fileno() < 0

    @property
    def has_unread(self) -> bool:
        """Return whether something has arrived that was not read yet."""
        return has_unread(self._wire)

    def end(self) -> None:
        """Close the connection at once, and drop what waits to be sent."""
        if self.is_silent:
            asyncio.get_running_loop().remove_reader(self._wire)
            self._wire.close()
        elif isinstance(self.transport, asyncio.WriteTransport):
            self.transport.abort()
        else:
            with contextlib.suppress(OSError):
                self._wire.shutdown(socket.SHUT_RDWR)


class ConnectionsByHolder:
    """The open connections, in order of age, and grouped by holder."""

    def __init__(self) -> None:
        self._by: dict[str, dict[Peer, Connection]] = {}
        self._peers: dict[Peer, Connection] = {}

    def __len__(self) -> int:
        return len(self._peers)

    def __iter__(self) -> Iterator[tuple[Peer, Connection]]:
        return iter(self._peers.items())

    def get(self, peer: Peer) -> Connection | None:
        """Return the connection whose other end has the address `peer`; None if there is no such
        connection."""
        return self._peers.get(peer)

    def most(self) -> dict[Peer, Connection]:
        """Return the connections of the holder with the most connections."""
        return max(self._by.values(), key=len)

    def add(self, peer: Peer, connection: Connection) -> None:
        """Add a connection; it replaces one of the same peer whose end was not noticed yet."""
        before = self._peers.get(peer)
        if before is not None:  # its end was not noticed yet
            self.remove(peer, before)
        self._peers[peer] = connection
        self._by.setdefault(connection.holder, {})[peer] = connection

    def remove(self, peer: Peer, connection: Connection) -> None:
        """Remove a connection. Do nothing if it is not the present connection of its peer."""
        if self._peers.get(peer) is not connection:
            return
        del self._peers[peer]
        theirs = self._by[connection.holder]
        del theirs[peer]
        if not theirs:
            del self._by[connection.holder]


class ConnectionHolder:
    """Sets the holder of a connection once the person is known."""

    def __init__(
        self, connections: "Connections", peer: Peer | None, connection: Connection | None
    ) -> None:
        self._connections = connections
        self._peer = peer
        self._connection = connection

    def asked(self, address: str) -> None:
        """Count the connection for this address, which a trusted proxy names."""
        self._hold(f"@{address}", is_stranger=True)

    def known(self, person: str) -> None:
        """Count the connection for this signed-in person."""
        self._hold(person, is_stranger=False)

    def _hold(self, holder: str, *, is_stranger: bool) -> None:
        if self._peer is not None and self._connection is not None:
            self._connections.hold(self._peer, self._connection, holder, is_stranger=is_stranger)


class Connections:
    """Accepts and limits all connections of a process.

    The access control reports who is known on which connection. `is_proxy` says which addresses
    send requests for others.
    """

    def __init__(self, limit: int, is_proxy: Callable[[str], bool] = lambda _: False) -> None:
        self._is_proxy = is_proxy
        self._most = max(32, min(_MOST, limit - _in_use() - _KEPT))
        self._most_strangers = max(16, min(_MOST_STRANGERS, self._most * 2 // 3))
        self._all = ConnectionsByHolder()
        self._strangers = ConnectionsByHolder()
        self._tasks: set[asyncio.Task[None]] = set()
        self._listeners: list[socket.socket] = []

    # --- coming in ----------------------------------------------------------------------------

    def listen(
        self, listener: socket.socket, factory: Factory, context: ssl.SSLContext | None
    ) -> None:
        """Accept connections at a listening socket from now on, and return at once. `factory` makes
        the protocol of each; `context` is its TLS, None for plain HTTP."""
        listener.setblocking(False)
        self._listeners.append(listener)
        asyncio.get_running_loop().add_reader(listener, self._accept, listener, factory, context)
        if len(self._listeners) == 1:
            self._keep(self._sweep())

    def close(self) -> None:
        """Stop accepting connections. Connections that are open stay open."""
        loop = asyncio.get_running_loop()
        for listener in self._listeners:
            loop.remove_reader(listener)
            listener.close()
        for _, each in tuple(self._all):
            if each.is_silent:
                each.end()
        for task in self._tasks:
            task.cancel()

    def _accept(
        self, listener: socket.socket, factory: Factory, context: ssl.SSLContext | None
    ) -> None:
        loop = asyncio.get_running_loop()
        for _ in range(_AT_ONCE):
            try:
                wire, address = listener.accept()
            except (BlockingIOError, InterruptedError, ConnectionAbortedError):
                return
            except OSError as error:  # no descriptor is left
                log.warning("a connection cannot be accepted: %s", error.strerror)
                self._make_room(self._strangers, max(0, len(self._strangers) // 2))
                self._keep(self._accept_again(listener, factory, context))
                return
            wire.setblocking(False)
            peer = (str(address[0]), int(address[1]))
            connection = Connection(wire, peer, of_proxy=self._is_proxy(peer[0]))
            self._all.add(peer, connection)
            self._strangers.add(peer, connection)
            self._make_room(self._strangers, self._most_strangers)
            self._make_room(self._all, self._most)
            loop.add_reader(wire, self._spoke, connection, wire, factory, context)

    def _spoke(
        self,
        connection: Connection,
        wire: socket.socket,
        factory: Factory,
        context: ssl.SSLContext | None,
    ) -> None:
        """Open a connection whose first bytes have come (`wire`: its socket). Until then it costs
        next to nothing, so that many silent ones take no time from the others."""
        asyncio.get_running_loop().remove_reader(wire)
        connection.is_silent = False
        self._keep(self._open(connection, wire, factory, context))

    async def _accept_again(
        self, listener: socket.socket, factory: Factory, context: ssl.SSLContext | None
    ) -> None:
        loop = asyncio.get_running_loop()
        loop.remove_reader(listener)
        await asyncio.sleep(_PAUSE_S)
        loop.add_reader(listener, self._accept, listener, factory, context)

    async def _open(
        self,
        connection: Connection,
        wire: socket.socket,
        factory: Factory,
        context: ssl.SSLContext | None,
    ) -> None:
        try:
            connection.transport, _ = await asyncio.get_running_loop().connect_accepted_socket(
                factory,
                wire,
                ssl=context,
                ssl_handshake_timeout=_SILENT_S if context is not None else None,
            )
        except (OSError, asyncio.CancelledError):  # closed too early, or the handshake failed
            wire.close()

    def _keep(self, work: Coroutine[Any, Any, None]) -> None:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # --- going --------------------------------------------------------------------------------

    def _make_room(self, among: ConnectionsByHolder, most: int) -> None:
        """Close connections until at most `most` are left. Each time, choose among the oldest
        connections of the holder that has most, and prefer a connection on which no request is
        being answered."""
        while len(among) > most:
            of_them = among.most()
            first = tuple(islice(of_them.items(), _LOOKED_AT))
            peer, connection = min(first, key=lambda item: item[1].answering > 0)
            connection.end()
            self._forget(peer, connection)

    def _forget(self, peer: Peer, connection: Connection) -> None:
        self._all.remove(peer, connection)
        self._strangers.remove(peer, connection)

    def _forget_gone(self) -> None:
        for peer, each in tuple(self._all):
            if each.is_over:
                self._forget(peer, each)

    async def _sweep(self) -> None:
        """End connections that sent no request in time, again and again."""
        while True:
            await asyncio.sleep(_SWEEP_S)
            self._forget_gone()
            late = time.monotonic() - _SILENT_S
            for _, each in tuple(self._all):
                if not each.answering and each.since < late and not each.has_unread:
                    each.end()

    # --- what is known ------------------------------------------------------------------------

    @contextlib.contextmanager
    def answering(self, peer: Peer | None) -> Iterator[ConnectionHolder]:
        """Return a context during which a request on the connection of `peer` counts as being
        answered. Its value takes the name of the person once that is known."""
        connection = None if peer is None else self._all.get(peer)
        holder = ConnectionHolder(self, peer, connection)
        if connection is None:
            yield holder
            return
        connection.answering += 1
        try:
            yield holder
        finally:
            connection.answering -= 1
            connection.since = time.monotonic()

    def hold(self, peer: Peer, connection: Connection, holder: str, *, is_stranger: bool) -> None:
        """Count a connection for another holder from now on; do nothing if it is the holder
        already. `is_stranger`: the holder is an address, not a signed-in person."""
        if connection.holder == holder:
            return
        self._forget(peer, connection)
        connection.holder = holder
        self._all.add(peer, connection)
        if is_stranger:
            self._strangers.add(peer, connection)

    def drop(self, peer: Peer | None) -> None:
        """Close the connection of `peer`, whose client has stopped responding. Do nothing for None
        or an unknown peer."""
        if peer is not None and (connection := self._all.get(peer)) is not None:
            connection.end()


def has_unread(wire: "HasFileno | None") -> bool:
    """Return whether bytes, or the end of the connection, have arrived at a socket and were not read
    yet. Return False for None and a closed socket.

    A loop that could not run for a while calls its timers before it reads. A timer that would close a
    connection for its silence asks this first: the request may be there, and it may be a Stop.
    """
    descriptor = -1 if wire is None else wire.fileno()
    if descriptor < 0:
        return False
    arrived = select.poll()
    arrived.register(descriptor, select.POLLIN)
    return bool(arrived.poll(0))


def _in_use() -> int:
    """Return the number of open file descriptors of this process."""
    try:
        return len(os.listdir("/proc/self/fd"))  # noqa: PTH208 - counted, not visited
    except OSError:
        return 64
