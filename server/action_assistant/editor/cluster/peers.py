"""The client for other editors: relays requests and sockets to the owner of their stream
(decision 175)."""

import asyncio
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager
from functools import cached_property
from typing import Final, NamedTuple, TypeVar
from urllib.parse import quote

import httpx
import msgspec
import websockets
from websockets.asyncio.client import ClientConnection, connect

from action_assistant.editor.cluster.owners import Elsewhere, Owners
from action_assistant.editor.cluster.relay_seal import SCHEME, RelayedFacts, RelaySeal
from action_assistant.errors import (
    NotFound,
    OutcomeUnknown,
    Refused,
    Unavailable,
    refused_elsewhere,
)
from action_assistant.logs import request_id
from action_assistant.web.auth.caller import caller

log: Final = logging.getLogger(__name__)

T = TypeVar("T")

#: What is relayed begins with this path at the other editor.
PREFIX: Final = "/internal"
#: The status with which an editor refuses what it does not own.
MISDIRECTED: Final = 421
_TRIES: Final = 3
_PAUSE_S: Final = 0.3  # before the n-th try, n times
_ASKED_EACH_S: Final = 1.0  # whether an editor that does not answer is still the owner
_TIMEOUT: Final = httpx.Timeout(120.0, connect=1.0)
_LIMITS: Final = httpx.Limits(
    max_connections=None, max_keepalive_connections=20, keepalive_expiry=2
)
_GOODBYE_S: Final = 1.0
#: Methods that change nothing, so that they may be relayed once more where the answer was lost.
_SAFE: Final = frozenset({"GET", "HEAD"})
_LEFT_AS_IS: Final = "%/:?@!$&'()*+,;=~-._"  # of a path or query, beside letters and digits
_SILENT: Final = "The editor that has this open does not answer; try again."
_UNREADABLE: Final = "The answer of another editor cannot be read."
_LOST: Final = "The editor that had this open has ended, and may have done it before that."


class _Unreached(Exception):
    """The owner certainly did nothing, so the request may be sent again."""


class _AnswerLost(Exception):
    """Nobody knows what the owner did."""


class Call(NamedTuple):
    """A request to relay. `target`: its path and query as they came in; `headers`: those that are
    relayed; `is_inner`: the server itself asks a room."""

    method: str
    target: str
    headers: Sequence[tuple[str, str]] = ()
    body: bytes = b""
    client: str = ""
    is_inner: bool = False


def plain_target(path: bytes, query: bytes) -> str:
    """Return path and query of a request as text that goes over the wire unchanged."""
    text = quote(path, safe=_LEFT_AS_IS)
    return f"{text}?{quote(query, safe=_LEFT_AS_IS)}" if query else text


class Peers:
    """Relays requests to the editors that own their streams. `owners` says which these are."""

    def __init__(self, owners: Owners, seal: RelaySeal) -> None:
        self._owners = owners
        self._seal = seal

    @cached_property
    def _http(self) -> httpx.AsyncClient:
        return httpx.AsyncClient(timeout=_TIMEOUT, limits=_LIMITS, trust_env=False)

    async def aclose(self) -> None:
        """Close the connections to other editors."""
        if "_http" in vars(self):
            await self._http.aclose()

    @asynccontextmanager
    async def answer(self, stream: str, call: Call) -> AsyncIterator[httpx.Response | None]:
        """Return a context with the answer of the owner of a stream, whose body was not read yet;
        None if no other editor owns it by now. Raise Unavailable if no owner answers,
        OutcomeUnknown if the owner may have done what was asked."""
        answer = await self._tried(
            stream, lambda owner: self._send(stream, owner, call), call.method
        )
        try:
            yield answer
        finally:
            if answer is not None:
                await answer.aclose()

    async def socket(self, stream: str, call: Call) -> "OpenSocket | Refusal | None":
        """Open a WebSocket at the owner of a stream, and return it, or the owner's refusal; None if
        no other editor owns it by now. Raise Unavailable if no owner answers."""
        return await self._tried(stream, lambda owner: self._connect(stream, owner, call), "GET")

    async def is_owner(self, stream: str, url: str) -> bool:
        """Return whether the editor at this URL still owns a stream."""
        owner = await self._owners.owner(stream)
        return isinstance(owner, Elsewhere) and owner.url == url

    async def _tried(
        self, stream: str, ask: Callable[[Elsewhere], Awaitable[T]], method: str
    ) -> T | None:
        for failed in range(_TRIES):
            await asyncio.sleep(failed * _PAUSE_S)
            owner = await self._owners.owner(stream)
            if not isinstance(owner, Elsewhere):
                return None
            try:
                return await ask(owner)
            except _Unreached as error:
                log.info("the editor at %s cannot be asked about %s: %s", owner.url, stream, error)
            except _AnswerLost as error:
                log.warning(
                    "the editor at %s gave no answer about %s: %s", owner.url, stream, error
                )
                if method not in _SAFE:
                    raise OutcomeUnknown(_LOST) from error
        raise Unavailable(_SILENT)

    async def _send(self, stream: str, owner: Elsewhere, call: Call) -> httpx.Response:
        url = httpx.URL(f"{owner.url}{PREFIX}{call.target}")
        path, _, _ = call.target.partition("?")
        if url.raw_path.partition(b"?")[0].count(b"/") != f"{PREFIX}{path}".count("/"):
            raise NotFound("There is nothing at this address.")  # it resolves to another path
        sealed = self._sealed(call, f"{owner.url}{url.raw_path.decode()}")
        request = httpx.Request(
            call.method, url, headers=[*call.headers, *sealed], content=call.body
        )
        request.extensions["timeout"] = _TIMEOUT.as_dict()
        try:
            sending = self._http.send(request, stream=True)
            answer = await self._while_owned(stream, owner, sending)
        except (httpx.ConnectError, httpx.ConnectTimeout, httpx.PoolTimeout) as error:
            raise _Unreached(repr(error)) from error
        except httpx.HTTPError as error:
            raise _AnswerLost(repr(error)) from error
        try:
            _require_taken(answer.status_code, answer.headers.get("www-authenticate", ""))
        except _Unreached:
            await answer.aclose()
            raise
        return answer

    async def _connect(self, stream: str, owner: Elsewhere, call: Call) -> "OpenSocket | Refusal":
        target = f"{PREFIX}{call.target}"
        opening = connect(
            f"{owner.url.replace('http', 'ws', 1)}{target}",
            additional_headers=[*call.headers, *self._sealed(call, f"{owner.url}{target}")],
            compression=None,
            user_agent_header=None,
            proxy=None,
            max_size=None,  # a document may be larger than any message of a client
            ping_interval=None,  # the other editor sends pings
            open_timeout=None,
            close_timeout=_GOODBYE_S,
        )
        try:
            return OpenSocket(owner.url, await self._while_owned(stream, owner, opening))
        except websockets.InvalidStatus as error:
            answer = error.response
            _require_taken(answer.status_code, answer.headers.get("www-authenticate", ""))
            return Refusal(
                answer.status_code, list(answer.headers.raw_items()), bytes(answer.body or b"")
            )
        except (OSError, websockets.WebSocketException, EOFError) as error:
            raise _Unreached(repr(error)) from error

    async def _while_owned(self, stream: str, owner: Elsewhere, work: Awaitable[T]) -> T:
        """Wait for the answer of the owner of a stream for as long as it is the owner."""
        task = asyncio.ensure_future(work)
        try:
            while not (await asyncio.wait([task], timeout=_ASKED_EACH_S))[0]:
                if not await self.is_owner(stream, owner.url):
                    raise _AnswerLost("another editor owns it by now")
            return task.result()
        finally:
            task.cancel()

    def _sealed(self, call: Call, url: str) -> list[tuple[str, str]]:
        asking = caller()
        identity = None if asking is None else asking.identity
        facts = RelayedFacts(identity, call.client, request_id() or "", call.is_inner)
        return self._seal.headers(call.method, url, call.body, facts)


def _require_taken(status: int, challenge: str) -> None:
    """Raise _Unreached if the status of an answer says that nothing was done: the other editor does
    not own the stream, or does not accept the seal."""
    if status == MISDIRECTED:
        raise _Unreached("it does not own it")
    if status == 401 and challenge == SCHEME:
        raise _Unreached("it does not take the seal: clocks differ by more than half a minute")


class _Problem(msgspec.Struct, frozen=True):
    """The part of problem details by which a refusal is raised again."""

    type: str
    detail: str
    where: dict[str, object] | None = None


def refusal(body: bytes) -> Refused:
    """Return the refusal that another editor has answered, to be raised here."""
    try:
        problem = msgspec.json.decode(body, type=_Problem)
    except msgspec.DecodeError:
        return Unavailable(_UNREADABLE)
    return refused_elsewhere(problem.type, problem.detail, problem.where)


class OpenSocket(NamedTuple):
    """A WebSocket that is open at the editor with this URL."""

    url: str
    connection: ClientConnection


class Refusal(NamedTuple):
    """The answer of another editor to a request for a WebSocket that it refused."""

    status: int
    headers: list[tuple[str, str]]
    body: bytes
