"""The entrance for what other editors relay: a listener of its own, never the public port
(decision 175)."""

import hashlib
from collections.abc import Callable
from contextlib import AsyncExitStack
from typing import Any, Final, Protocol
from urllib.parse import parse_qs

import msgspec
from litestar.enums import ScopeType
from litestar.types import HTTPScope, Receive, Scope, Send, WebSocketScope

from action_assistant.editor.cluster.owners import Elsewhere
from action_assistant.editor.cluster.peers import MISDIRECTED, PREFIX, plain_target
from action_assistant.editor.cluster.relay import Replayed, stream_of, whole_body
from action_assistant.editor.cluster.relay_seal import (
    DIGEST,
    FACTS,
    SCHEME,
    RelayedFacts,
    RelaySeal,
)
from action_assistant.editor.cluster.shared_desk import CALLS, SIGN_IN, SharedDesk
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.remote_room import (
    AUTHOR,
    EXPECTED,
    ROOMS,
    SEQ,
    TURN,
    TURN_HEADER,
    SubmittedSeq,
)
from action_assistant.editor.rooms.remote_turns import RemoteTurns
from action_assistant.errors import NotFound, Refused, Unauthenticated, Unavailable
from action_assistant.logs import begin
from action_assistant.web.auth.access import origin_by
from action_assistant.web.auth.caller import Origin, acting_for
from action_assistant.web.auth.identity import Identity
from action_assistant.web.http.refusals import answer, refuse, refuse_socket

_CALLS: Final = frozenset({"http", "websocket"})
#: Header fields that end here.
_SEALS: Final = frozenset({b"authorization", FACTS.encode(), DIGEST.encode()})


class Admitted(Protocol):
    """The application behind the access control, for requests that another editor has admitted."""

    async def __call__(
        self, scope: HTTPScope | WebSocketScope, receive: Receive, send: Send, identity: Identity
    ) -> None:
        """Answer a request of this identity."""


class Entrance:
    """An ASGI application that takes what other editors have sealed, for graphs that this editor
    owns, and nothing else. It relays nothing on: what this editor does not own is refused with 421.
    `url`: where the others find it."""

    def __init__(
        self,
        app: Admitted,
        url: str,
        seal: RelaySeal,
        rooms: Callable[[], Rooms],
        desk: SharedDesk,
    ) -> None:
        self._app = app
        self._url = url
        self._seal = seal
        self._rooms = rooms
        self._desk = desk
        self._turns: Final = RemoteTurns(rooms)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer a request of another editor. The parameters are those of ASGI."""
        if scope["type"] not in _CALLS:
            return
        call: Any = scope
        try:
            try:
                facts, body = await self._verified(call, receive)
                if facts.identity is None and not facts.is_inner:
                    raise Unauthenticated("Nobody is named for whom this is.")
            except Unauthenticated as refused:
                await refuse(call, receive, send, refused, challenge=SCHEME)
                return
            path = call["path"].removeprefix(PREFIX)
            stream = _inner_stream(path) if facts.is_inner else stream_of(path)
            if stream is None:
                raise NotFound(f"Nothing is relayed to {path}.")
            begin({"request": facts.request})
            if not await self._answered(stream, call, receive, send, facts, body):
                await _misdirect(call, receive, send)
        except Refused as refused:
            await refuse(call, receive, send, refused)

    async def _answered(
        self,
        stream: str,
        scope: Any,
        receive: Receive,
        send: Send,
        facts: RelayedFacts,
        body: bytes,
    ) -> bool:
        """Answer a verified request. Return False if this editor does not own the stream."""
        async with AsyncExitStack() as holding:
            try:
                owner = await holding.enter_async_context(self._rooms().owned(stream))
            except Unavailable:  # it is about to end, or its database is away
                return False
            if isinstance(owner, Elsewhere):
                return False
            if stream == SIGN_IN:
                path = scope["path"].removeprefix(PREFIX)
                await answer(send, 200, [], await self._desk.answer(path, body))
            elif facts.is_inner:
                await self._room(stream, scope, send, facts, body)
            elif facts.identity is not None:
                prefix = len(PREFIX)
                inner: Any = {
                    **scope,
                    "path": scope["path"].removeprefix(PREFIX),
                    "raw_path": scope["raw_path"][prefix:],
                    "headers": [each for each in scope["headers"] if each[0] not in _SEALS],
                    "client": (facts.client, 0),
                }
                is_http = scope["type"] == ScopeType.HTTP
                rest = Replayed(body, receive) if is_http else receive
                await self._app(inner, rest, send, facts.identity)
        return True

    async def _room(
        self, stream: str, scope: Any, send: Send, facts: RelayedFacts, body: bytes
    ) -> None:
        """Answer what a `RemoteRoom` asks: the document (GET), or to store an edit (POST)."""
        query = {name: value for name, (value,) in parse_qs(scope["query_string"].decode()).items()}
        if TURN in query:
            await self._turn(stream, scope["method"], send, facts, query[TURN], body)
            return
        async with self._rooms().enter(stream) as room:
            if scope["method"] == "GET":
                seq, state = await room.now()
                await answer(send, 200, [(SEQ.encode(), str(seq).encode())], state)
                return
            author, expected = query[AUTHOR], query.get(EXPECTED)
            with acting_for(author, _origin(facts, author)):
                seq = await room.submit(body, author, None if expected is None else int(expected))
            await answer(send, 200, [], msgspec.json.encode(SubmittedSeq(seq)))

    async def _turn(
        self, stream: str, method: str, send: Send, facts: RelayedFacts, turn: str, body: bytes
    ) -> None:
        """Begin a turn in a room for an author (GET), store its edit (POST), or end it without one
        (DELETE)."""
        if method == "GET":
            with acting_for(turn, _origin(facts, turn)):
                made, (seq, state) = await self._turns.begin(stream, turn)
            fields = [(SEQ.encode(), str(seq).encode()), (TURN_HEADER.encode(), made.encode())]
            await answer(send, 200, fields, state)
        elif method == "POST":
            seq = await self._turns.end(turn, body)
            await answer(send, 200, [], msgspec.json.encode(SubmittedSeq(seq)))
        else:
            self._turns.cancel(turn)
            await answer(send, 204, [], b"")

    async def _verified(self, scope: Any, receive: Receive) -> tuple[RelayedFacts, bytes]:
        """Return who asks, and the body. Raise Unauthenticated, before the body is read, for what
        no editor has sealed."""
        headers = {
            name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]
        }
        target = plain_target(scope["raw_path"], scope["query_string"])
        facts = self._seal.verified(scope.get("method", "GET"), f"{self._url}{target}", headers)
        is_socket = scope["type"] == ScopeType.WEBSOCKET
        body = b"" if is_socket else await whole_body(receive)
        if hashlib.sha256(body).hexdigest() != headers[DIGEST]:
            raise Unauthenticated("This is not the body that an editor has sealed.")
        return facts, body


def _inner_stream(path: str) -> str | None:
    """Return the stream to whose owner a request of an editor itself belongs; None for unknown
    paths."""
    if path.startswith(CALLS):
        return SIGN_IN
    return path.removeprefix(ROOMS) if path.startswith(ROOMS) else None


def _origin(facts: RelayedFacts, author: str) -> Origin | None:
    """Return from where an author acts; None if another person or the server itself asks."""
    identity = facts.identity
    return origin_by(identity) if identity is not None and identity.person.id == author else None


async def _misdirect(scope: Any, receive: Receive, send: Send) -> None:
    """Answer that this editor does not own the stream."""
    if scope["type"] == ScopeType.WEBSOCKET:
        await refuse_socket(receive, send, MISDIRECTED, [], b"")
    else:
        await answer(send, MISDIRECTED, [], b"")
