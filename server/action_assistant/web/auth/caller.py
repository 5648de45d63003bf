"""Tracks the client for whom a task works, so that the work can be cancelled when the client disconnects.

Imported by workers too, so it imports little.
"""

import ipaddress
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NamedTuple, TypeVarTuple, Unpack

import anyio
import msgspec
from anyio.abc import TaskGroup

from action_assistant.errors import Refused

if TYPE_CHECKING:
    from litestar.connection import ASGIConnection
    from litestar.types import Receive

    from action_assistant.web.auth.identity import Identity


#: The field of an event's body that holds its `Origin`.
_FIELD: Final = "from"


class Origin(msgspec.Struct, frozen=True, omit_defaults=True):
    """The connection by which a person acted, as an event keeps it.

    `name`: of the person at that time. `session`: the id of the browser's session. `token`: the id of
    a program's token, "server" for that of the owner. `address`: on the network, "" for the computer
    of the server itself.
    """

    name: str = ""
    session: str = ""
    token: str = ""
    address: str = ""


class _Stamped(msgspec.Struct, rename={"origin": _FIELD}):
    origin: Origin | None = None


def network_address(host: str) -> str:
    """Return an address on the network; "" for this computer itself, and for text that is no
    address."""
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return ""
    return "" if address.is_loopback else str(address)


def client_network(connection: "ASGIConnection[Any, Any, Any, Any]") -> str:
    """Return the network of a client, which limits count as one."""
    return network_of(connection.client.host if connection.client is not None else "")


def network_of(host: str) -> str:
    """Return the network whose addresses limits count as one client. For an IPv4 address this is
    the address itself; for an IPv6 address its /64 network, since one client can own all of it; for
    an IPv4-mapped IPv6 address the IPv4 address. ::1, and text that is no address, are returned
    unchanged."""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    if isinstance(address, ipaddress.IPv4Address):
        return host
    if address.ipv4_mapped is not None:
        return str(address.ipv4_mapped)
    return host if address.is_loopback else str(ipaddress.ip_network((address, 64), strict=False))


@lru_cache(1024)
def _end_of_body(origin: Origin) -> bytes:
    """Return the field with an origin, and the brace that ends the body."""
    return msgspec.json.encode(_Stamped(origin))[1:]


class Caller(NamedTuple):
    """Identifies the client for whom a request works, so that abandoned work can be cancelled.

    `device`: the id of the browser, whoever is signed in; "" if unknown. `origin`: None where it is
    not known by which connection the person acts.
    """

    person: str
    receive: "Receive | None" = None  # a socket's messages are not ours to read
    device: str = ""
    origin: Origin | None = None
    identity: "Identity | None" = None  # None for work of the server itself

    async def gone(self) -> None:
        """Wait until the client has disconnected. Call it only after the request body was read."""
        if self.receive is None:
            await anyio.sleep_forever()
        else:
            try:
                while (await self.receive())["type"] != "http.disconnect":
                    pass
            except Refused:  # nothing more can be read of them
                pass


_Values = TypeVarTuple("_Values")

_CALLER: Final[ContextVar[Caller | None]] = ContextVar("caller", default=None)


def caller() -> Caller | None:
    """Return the client for whom this task works; None if the task works for no client."""
    return _CALLER.get()


def device() -> str:
    """Return the id of the browser for which this task works; "" if unknown."""
    asking = _CALLER.get()
    return "" if asking is None else asking.device


def origin_of(author: str) -> Origin | None:
    """Return the connection by which this person acts in this task; None if the task works for
    somebody else or for no client."""
    asking = _CALLER.get()
    return None if asking is None or asking.person != author else asking.origin


def stamped(body: bytes, author: str) -> bytes:
    """Return the JSON body of an event, an object or nothing, with the origin of its author as the
    field `from`. The body stays as it is if the task does not work for this person."""
    origin = origin_of(author)
    if origin is None or (body and not body.endswith(b"}")):
        return body
    start = b"{" if body in {b"", b"{}"} else body[:-1] + b","
    return start + _end_of_body(origin)


def origin_in(body: bytes) -> Origin | None:
    """Return the origin in the body of a stored event; None if the body has none."""
    if b'"from":' not in body:
        return None
    try:
        return msgspec.json.decode(body, type=_Stamped).origin
    except (ValueError, RecursionError):  # a body of another form
        return None


def without_origin(body: bytes) -> bytes:
    """Return the body of a stored event without its origin, which only owners see."""
    if origin_in(body) is None:
        return body
    fields = msgspec.json.decode(body, type=dict[str, msgspec.Raw])
    del fields[_FIELD]
    return msgspec.json.encode(fields)


def set_caller(asking: Caller | None) -> None:
    """Set the client for whom this task works from now on."""
    _CALLER.set(asking)


def outlive_connection() -> None:
    """Let this task continue after the end of the connection for which it was started. It still
    counts for its person."""
    asking = _CALLER.get()
    _CALLER.set(None if asking is None else asking._replace(receive=None))


@contextmanager
def acting_for(person: str, origin: Origin | None = None) -> Iterator[None]:
    """Set the person for whom the work inside the block is done, and the connection by which that
    person asked for it."""
    token = _CALLER.set(Caller(person, origin=origin))
    try:
        yield
    finally:
        _CALLER.reset(token)


def detach_from_request() -> None:
    """Detach this task, and those that it starts, from the request in which it was started."""
    _CALLER.set(None)


class BackgroundTasks:
    """Starts tasks that outlive the request in which they begin.

    A task inherits the caller of the code that starts it. When the request of that caller ends, a
    worker would refuse the task, and the error would end the whole group. So services that live as
    long as their process get this instead of a TaskGroup.
    """

    def __init__(self, tasks: TaskGroup) -> None:
        self._tasks = tasks

    def start_soon(
        self,
        work: Callable[[Unpack[_Values]], Coroutine[object, object, object]],
        *values: *_Values,
    ) -> None:
        """Start a task without a caller."""
        token = _CALLER.set(None)
        try:
            self._tasks.start_soon(work, *values)
        finally:
            _CALLER.reset(token)
