"""Listening: sockets bound first, so that a taken port is one clear sentence; then uvicorn."""

import asyncio
import gc
import logging
import socket
import sys
import threading
import time
from collections.abc import Awaitable, Callable, Sequence
from contextlib import AbstractContextManager, ExitStack, suppress
from contextvars import ContextVar
from types import FrameType
from typing import TYPE_CHECKING, Any, Final

import h11
import uvicorn
from litestar.enums import ScopeType
from litestar.types import ASGIApp, Message, Receive, Scope, Send
from uvicorn.protocols.http.h11_impl import H11Protocol

from action_assistant.errors import BadInput, CannotStart
from action_assistant.public_url import Network
from action_assistant.system import posix, service_manager
from action_assistant.system.parent import when_parent_ends
from action_assistant.web.auth.access import KNOWN
from action_assistant.web.network.connections import Connections, has_unread
from action_assistant.web.server.application import Application
from action_assistant.web.server.direct import DirectSocket, WebSocketProtocol, end_connection
from action_assistant.web.server.proxy import ASKED, Forwarded
from action_assistant.web.server.sockets import bound

if TYPE_CHECKING:  # slow to load, and most servers do without
    from action_assistant.web.network.certificate import Certificate

log: Final = logging.getLogger(__name__)

WEBSOCKET_LIMIT: Final = 1_114_112  # bytes; an update of 1 MiB and its frame
GRACE: Final = 5  # seconds that open requests get when the process is told to end
HEAD_LIMIT: Final = 32_768  # bytes of a request line and its header fields
_CALLS: Final = frozenset({"http", "websocket"})
_WITHOUT_BODY: Final = frozenset({"GET", "HEAD", "OPTIONS"})
#: Processor time and time (seconds) when what is answered came in.
_RECEIVED: Final[ContextVar[tuple[float, float]]] = ContextVar("received", default=(0.0, 0.0))
_DRAIN_S: Final = 8.0
_FAILED: Final = 3  # exit code when the application could not be set up
_BODY_S: Final = 30.0  # between two pieces of a body
_ENDED_EARLY: Final = "The body ended early."
_LENGTH_REQUIRED: Final = "411 Length Required", "A body has a length."
_ADDRESS_TOO_LONG: Final = "414 URI Too Long", f"An address has fewer than {HEAD_LIMIT} bytes."
_HEAD_TOO_LONG: Final = (
    "431 Request Header Fields Too Large",
    f"An address and its header fields have fewer than {HEAD_LIMIT} bytes together.",
)
_TOO_LONG: Final = 431  # as h11 has it
_HEARS_OUT_S: Final = 1.0  # after a refusal
_HEARS_OUT: Final = 1 << 20  # bytes
_LOOK_S: Final = 60.0  # between two looks at the certificate
_PINGS: Final = 4  # in the time within which systemd wants one
_GARBAGE: Final = (10_000, 10, 10)  # objects, and collections of the younger generations


def serve(
    make: Callable[[], Application],
    *,
    host: str,
    port: int,
    identity: "TlsIdentity | None" = None,
    proxies: tuple[Network, ...] = (),
    direct: bool = False,
    publish: Callable[[str], AbstractContextManager[None]] | None = None,
    inside: tuple[str, int] | None = None,
) -> None:
    """Bind `host` and `port`, then make the application and serve it until the process is told to
    end or its parent dies. `identity`: serve TLS with its certificate. `proxies`: addresses whose
    forwarding headers are trusted. `direct`: let the application take over WebSockets, so that
    their binary messages reach it without the server's queues (`direct.py`). `publish`: called with
    the URL by which programs on this computer reach the process; its context is entered once the
    application is set up, and left when it shuts down. `inside`: the host and port at which other editors of
    the server reach the application's entrance. Raise CannotStart if an address is taken or
    unknown, or if the application cannot start or go on."""
    sockets, inner = bound(host, port), []
    try:
        inner = [] if inside is None else bound(*inside, option="--cluster-listen")
        if identity is not None:
            identity.certificate.renew(identity.names())
        application = make()
    except BaseException:
        for listener in [*sockets, *inner]:
            listener.close()
        raise
    endings = StreamEndings(application)
    forwarded = Forwarded(endings, proxies)
    connections = Connections(posix.raise_descriptors(), forwarded.is_proxy)
    app = ActivityTracker(forwarded, connections)
    config = _configured(app, identity, direct=direct)
    logging.getLogger("uvicorn.error").addFilter(_shorten_error)
    server = _Server(config, endings, connections, publish)
    if application.entrance is not None:
        entrance = ActivityTracker(application.entrance, connections)
        server.listen_inside(inner, _configured(entrance, None, direct=direct))
    server.drain = application.drain
    application.end = server.end
    # Else uvicorn would log a traceback of what is said in one sentence.
    logging.getLogger("uvicorn.error").addFilter(
        lambda _: server.started or not application.refusals
    )
    when_parent_ends(server.end)
    try:
        server.run(sockets=sockets)
    except SystemExit:
        if not application.refusals:
            raise
    if application.refusals:
        raise application.refusals[0]
    if not server.started:
        raise CannotStart("The process could not be set up; the log above says why.")


def _configured(app: ASGIApp, identity: "TlsIdentity | None", *, direct: bool) -> uvicorn.Config:
    config = uvicorn.Config(
        app,
        http=_Http,
        h11_max_incomplete_event_size=HEAD_LIMIT,
        lifespan="on",
        log_config=None,
        access_log=False,
        proxy_headers=False,
        server_header=False,
        ws=DirectSocket if direct else WebSocketProtocol,
        ws_max_size=WEBSOCKET_LIMIT,
        ws_per_message_deflate=False,
        ws_ping_interval=10,
        ws_ping_timeout=10,
        timeout_graceful_shutdown=GRACE,
        timeout_notify=int((service_manager.watchdog_s() or 0) / _PINGS),
        callback_notify=_ping if service_manager.watchdog_s() is not None else None,
        ssl_certfile=identity.certificate.chain if identity is not None else None,
        ssl_keyfile=str(identity.certificate.key) if identity is not None else None,
    )
    if identity is not None:
        identity.keep(config)
    return config


async def _ping() -> None:
    """Tell systemd that the loop, which calls this, goes on."""
    service_manager.notify("WATCHDOG=1")


class TlsIdentity:
    """Keeps the certificate of this server, and renews it in time and when its names change."""

    def __init__(self, certificate: "Certificate", names: Callable[[], Sequence[str]]) -> None:
        self.certificate: Final = certificate
        self.names: Final = names
        self._loaded = 0  # when the certificate that is in use was written

    def keep(self, config: uvicorn.Config) -> None:
        """Watch the certificate on a daemon thread, and load each new one into the TLS context of
        `config`. Open connections keep theirs."""

        def look() -> None:
            """Renew the certificate, and load one that has changed, as long as the process lives."""
            while True:
                time.sleep(_LOOK_S)
                try:
                    fresh = self.certificate.renew(self.names())
                    loaded = self.certificate.chain.stat().st_mtime_ns
                except (CannotStart, OSError) as error:
                    log.error("the certificate was not renewed: %s", error)
                    continue
                if (fresh or loaded != self._loaded) and config.ssl is not None:
                    config.ssl.load_cert_chain(self.certificate.chain, self.certificate.key)
                    self._loaded = loaded
                    log.info("a new certificate is in use")

        self._loaded = self.certificate.chain.stat().st_mtime_ns
        threading.Thread(target=look, name="certificate", daemon=True).start()


class StreamEndings:
    """An ASGI middleware that ends endless streams when the process shuts down.

    A stream of server-sent events receives a disconnect. Other requests are answered completely.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._told = asyncio.Event()

    def begin(self) -> None:
        """End every open stream, and each later one at its beginning."""
        self._told.set()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and end its stream when the process shuts down. The parameters are
        those of ASGI."""
        if scope["type"] != ScopeType.HTTP:
            await self._app(scope, receive, send)
            return
        asked = streaming = False

        async def received() -> Any:
            nonlocal asked
            if not asked:
                message = await receive()
                asked = not message.get("more_body", False)
                return message
            return await self._next(receive)

        async def sent(message: Message) -> None:
            nonlocal streaming
            streaming = bool(message.get("more_body", message["type"] == "http.response.start"))
            await send(message)

        await self._app(scope, received, sent)
        if streaming and self._told.is_set():
            await send({"type": "http.response.body", "body": b"", "more_body": False})

    async def _next(self, receive: Receive) -> Any:
        """Wait for the client's next message, or for the shutdown of this process, which is
        returned as a disconnect."""
        gone = asyncio.ensure_future(receive())
        told = asyncio.ensure_future(self._told.wait())
        try:
            await asyncio.wait({gone, told}, return_when=asyncio.FIRST_COMPLETED)
            return gone.result() if gone.done() else {"type": "http.disconnect"}
        finally:
            gone.cancel()
            told.cancel()


class ActivityTracker:
    """An ASGI middleware that reports which connections are being answered, and for whom.

    It also refuses requests whose announced body does not come in time.
    """

    def __init__(self, app: ASGIApp, connections: Connections) -> None:
        self._app = app
        self._connections = connections

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, and count its connection as being answered until that is done. The
        parameters are those of ASGI."""
        if scope["type"] not in _CALLS:  # lifespan
            await self._app(scope, receive, send)
            return
        peer: Any = scope.get("client")
        whole = not _waits_for_body(scope)

        async def received() -> Any:
            """Return the next message of the request; refuse a body that comes too slowly or ends early."""
            nonlocal whole
            if whole:
                return await receive()
            try:
                async with asyncio.timeout(_BODY_S):
                    message: Any = await receive()
            except TimeoutError:
                self._connections.drop(peer)
                raise BadInput(_ENDED_EARLY) from None
            if message["type"] == "http.disconnect":
                raise BadInput(_ENDED_EARLY)
            whole = not message.get("more_body", False)
            return message

        async def sent(message: Message) -> None:
            if message["type"] == "http.response.start" and scope["path"].endswith("/stop"):
                message["headers"] = [*message.get("headers", []), _time_header()]
            await send(message)

        with self._connections.answering(peer and tuple(peer)) as holder:
            scope.setdefault("state", {}).update({KNOWN: holder.known, ASKED: holder.asked})
            await self._app(scope, received, sent)


def _waits_for_body(scope: Scope) -> bool:
    """Return whether the server has to wait for the body of a request (its ASGI scope) before it
    answers. A method without a body is answered at once, since a client would take a failure of
    that wait for a failed request."""
    if scope["type"] != ScopeType.HTTP or scope["method"] in _WITHOUT_BODY:
        return False
    return any(name == b"content-length" and value != b"0" for name, value in scope["headers"])


def _time_header() -> tuple[bytes, bytes]:
    """Return the header with the time since a Stop came in: processor time and wall time, in
    milliseconds."""
    cpu, wall = _RECEIVED.get()
    spent, took = time.process_time() - cpu, time.perf_counter() - wall
    return b"server-timing", f"cpu;dur={1e3 * spent:.3f}, total;dur={1e3 * took:.3f}".encode()


class _Http(H11Protocol):
    """HTTP for request bodies with a length only."""

    def __init__(self, *args: Any, **more: Any) -> None:
        super().__init__(*args, **more)
        self._strict = self.conn = _Strict(h11.SERVER, HEAD_LIMIT)
        self._ignored: int | None = None  # bytes since a refusal

    def data_received(self, data: bytes) -> None:
        """Handle received bytes, and store the time of it, from which the header of a Stop is
        computed. After a refusal some are ignored: if they were not read, the reset of the connection
        would take the refusal from its reader."""
        if self._ignored is not None:
            self._ignored += len(data)
            if self._ignored > _HEARS_OUT:
                self.transport.close()
            return
        _RECEIVED.set((time.process_time(), time.perf_counter()))
        super().data_received(data)

    def timeout_keep_alive_handler(self) -> None:
        """Close a connection on which no further request came in time. If one has arrived but was
        not read yet, let it be read."""
        if has_unread(self.transport.get_extra_info("socket")):
            self.timeout_keep_alive_task = self.loop.call_later(
                self.timeout_keep_alive, self.timeout_keep_alive_handler
            )
            return
        super().timeout_keep_alive_handler()

    def send_400_response(self, msg: str) -> None:
        """Answer a malformed request with a refusal: 411 if its body has no length, 414 or 431 if
        its address or header fields are too long, else 400 with the text `msg`."""
        if self._strict.refusal is None:
            super().send_400_response(msg)
            return
        status, text = self._strict.refusal
        self.transport.write(
            f"HTTP/1.1 {status}\r\ncontent-type: text/plain; charset=utf-8\r\nconnection: close\r\n"
            f"content-length: {len(text) + 1}\r\n\r\n{text}\n".encode()
        )
        self._ignored = 0
        self.loop.call_later(_HEARS_OUT_S, self.transport.close)

    def shutdown(self) -> None:
        """Close the connection, since the process shuts down."""
        if self._ignored is not None:
            self.transport.close()
        elif not self.transport.is_closing():
            end_connection(self.transport, super().shutdown)
            return
        # All is said, and goes out as far as the peer reads it. A refusal is none that h11 knows of.
        self._unset_keepalive_if_required()


class _Strict(h11.Connection):
    """Refuses a body without a length: to read chunks of one byte costs the server a thousand times
    more than the client, which is not authenticated yet. `refusal`: status and text for what was not
    taken, None if there is nothing special to say."""

    refusal: tuple[str, str] | None = None

    def next_event(self) -> Any:
        """Return the next event. Raise RemoteProtocolError for a request whose body has no length,
        or whose head is too long."""
        try:
            event = super().next_event()
        except h11.RemoteProtocolError as error:
            if error.error_status_hint == _TOO_LONG:
                in_address = b"\n" not in self.trailing_data[0]
                self.refusal = _ADDRESS_TOO_LONG if in_address else _HEAD_TOO_LONG
            raise
        if isinstance(event, h11.Request):
            names = [name for name, _ in event.headers]
            if b"transfer-encoding" in names:
                self.refusal = _LENGTH_REQUIRED
                raise h11.RemoteProtocolError("a body needs a length", error_status_hint=411)
        return event


class _Server(uvicorn.Server):
    """A server that ends streams before it waits for open requests."""

    def __init__(
        self,
        config: uvicorn.Config,
        endings: StreamEndings,
        connections: Connections,
        publish: Callable[[str], AbstractContextManager[None]] | None,
    ) -> None:
        super().__init__(config)
        self._endings = endings
        self._connections = connections
        self._publish = publish
        self._published = ExitStack()
        self._ends: Final = asyncio.Event()
        self._inside: list[socket.socket] = []
        self._inner_config: uvicorn.Config | None = None
        self.drain: Callable[[], Awaitable[None]] | None = None
        self._loop: asyncio.AbstractEventLoop | None = None

    def listen_inside(self, sockets: list[socket.socket], config: uvicorn.Config) -> None:
        """Serve the application of `config` at other sockets, too, from the startup on."""
        config.load()
        self._inside, self._inner_config = sockets, config

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Take up a signal that ends the server. Python calls this between two of its steps."""
        super().handle_exit(sig, frame)
        self.end()

    def end(self) -> None:
        """Let the server shut down. Any thread may call this, and a signal handler."""
        self.should_exit = True
        if self._loop is not None:
            self._loop.call_soon_threadsafe(self._ends.set)

    async def main_loop(self) -> None:
        """Keep the header with the date right until the server is to end. uvicorn looks for that
        ten times a second, which is half of what a process does at rest."""
        self._loop = asyncio.get_running_loop()
        seconds = 0
        while not await self.on_tick(10 * seconds):  # uvicorn counts tenths
            seconds += 1
            with suppress(TimeoutError):
                async with asyncio.timeout(1):
                    await self._ends.wait()

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Run the startup of the application, then accept connections on `sockets` by `Connections`
        and not by uvicorn, which counts a connection only after its handshake, when there may be no
        free file descriptor any more."""
        await self.lifespan.startup()
        if self.lifespan.should_exit:
            sys.exit(_FAILED)
        self.servers = []
        for listener in sockets or []:
            self._connections.listen(listener, self._protocol, self.config.ssl)
        for listener in self._inside:
            self._connections.listen(listener, self._inner_protocol, None)
        self.started = True
        self._publish_address(sockets or [])
        service_manager.notify("READY=1")
        # What is there now stays: looking through it for garbage again and again costs a busy
        # process a fifth of its time.
        gc.collect()
        gc.freeze()
        gc.set_threshold(*_GARBAGE)
        gc.enable()

    def _publish_address(self, sockets: list[socket.socket]) -> None:
        """Publish the address of the first socket. Without that, commands need --port."""
        if self._publish is None or not sockets:
            return
        url = _local_url(sockets[0], secure=self.config.ssl is not None)
        try:
            self._published.enter_context(self._publish(url))
        except OSError as error:
            log.error(
                "the data folder cannot keep the address %s (%s): commands on this computer need --port",
                url,
                error.strerror,
            )

    async def _drain(self, drain: Callable[[], Awaitable[None]]) -> None:
        try:
            async with asyncio.timeout(_DRAIN_S):
                await drain()
        except Exception:  # it ends all the same
            log.exception("not everything was left in order")

    def _inner_protocol(self) -> asyncio.Protocol:
        return _Http(config=self._inner_config, server_state=self.server_state, app_state={})

    def _protocol(self) -> asyncio.Protocol:
        return _Http(
            config=self.config, server_state=self.server_state, app_state=self.lifespan.state
        )

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Shut down: let other processes take over, end streams, close the listeners, and wait for open
        requests. uvicorn calls this once."""
        service_manager.notify("STOPPING=1")
        self._published.close()
        if self.drain is not None:
            await self._drain(self.drain)
        self._endings.begin()
        self._connections.close()
        await super().shutdown(sockets)


def _local_url(listener: socket.socket, *, secure: bool) -> str:
    """Return the URL by which programs of this computer reach a listening socket."""
    host, port = listener.getsockname()[:2]
    host = {"0.0.0.0": "127.0.0.1", "::": "::1"}.get(host, host)
    return f"{'https' if secure else 'http'}://{f'[{host}]' if ':' in host else host}:{port}"


def _shorten_error(record: logging.LogRecord) -> bool:
    """Filter a log record: turn an error that a malformed message of a client causes into a warning
    without a traceback. Always return True, so that no line is lost."""
    if "Invalid UTF-8" in record.msg:
        record.exc_info = None
        record.levelno, record.levelname = logging.WARNING, "WARNING"
    return True
