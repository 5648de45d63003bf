"""The end of a process, whatever state its connections are in: those who did nothing are told."""

import contextlib
import signal
import socket
import ssl
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory

import httpx
import pytest
import uvicorn
from uvicorn.server import ServerState

from action_assistant.web.server.listen import _Http
from support.product import TOKEN
from web.process import BEARER, UPGRADE, started
from web.server.wire import Wire, frame

RESTARTING = b"\x88\x02" + (1012).to_bytes(2, "big")
CRUMBS = b"POST /api/session HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n"
#: More than the kernels keep for both sides, and the server behind them.
MANY_PINGS = frame(0x89, b"x" * 125, b"mask") * 40_000
GOODBYE = frame(0x88, b"\x03\xe8", b"mask")


def test_systemd_hears_that_a_process_is_ready_goes_on_and_ends(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with TemporaryDirectory(dir="/tmp") as near, socket.socket(socket.AF_UNIX, 2) as manager:
        manager.bind(f"{near}/notify")  # paths of sockets are short
        manager.settimeout(30)
        monkeypatch.setenv("NOTIFY_SOCKET", f"{near}/notify")
        monkeypatch.setenv("WATCHDOG_USEC", "1000000")
        with started("editor", tmp_path):
            heard = {manager.recv(100), manager.recv(100)}
            pings = [manager.recv(100) for _ in range(3)]
        while (last := manager.recv(100)) == b"WATCHDOG=1":
            pass
    assert heard == {b"READY=1", b"WATCHDOG=1"}
    assert pings == 3 * [b"WATCHDOG=1"]
    assert last == b"STOPPING=1"


class Place:
    """An editor with a graph, and who comes there."""

    def __init__(self, stack: ExitStack, port: int, *, tls: bool) -> None:
        self._stack = stack
        self._port = port
        self._tls = ssl._create_unverified_context() if tls else None
        self._http = stack.enter_context(
            httpx.Client(
                base_url=f"http{'s' * tls}://127.0.0.1:{port}",
                headers=BEARER,
                trust_env=False,
                verify=False,
                timeout=20,
            )
        )
        graph = self._http.post("/api/graphs", json={"name": "g"}).json()["id"]
        self.upgrade = UPGRADE % (graph.encode(), TOKEN.encode())

    def connected(self) -> socket.socket:
        """Return a connection that has sent nothing yet, and for which the kernel buffers
        little."""
        one = self._stack.enter_context(socket.socket())
        one.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 8192)
        one.settimeout(20)
        one.connect(("127.0.0.1", self._port))
        if self._tls is None:
            return one
        return self._stack.enter_context(self._tls.wrap_socket(one))

    def in_room(self) -> socket.socket:
        """Return a connection whose room socket is open."""
        one = self.connected()
        one.sendall(self.upgrade)
        assert one.recv(100).startswith(b"HTTP/1.1 101")
        return one

    def wait_for(self, count: int) -> None:
        """Wait until the editor has `count` sockets in rooms."""
        deadline = time.monotonic() + 20
        while f"\naction_assistant_sockets {count}\n" not in self._http.get("/metrics").text:
            assert time.monotonic() < deadline
            time.sleep(0.05)


def says_goodbye_and_reads_nothing(place: Place) -> None:
    one = place.in_room()
    one.sendall(MANY_PINGS)
    place.wait_for(2)
    one.sendall(GOODBYE)
    place.wait_for(1)


def is_refused_and_does_not_close(place: Place) -> None:
    one = place.connected()
    one.sendall(CRUMBS)
    assert one.recv(100).startswith(b"HTTP/1.1 411")


def asks_for_an_upgrade_that_the_parser_refuses(place: Place) -> None:
    one = place.connected()
    one.sendall(place.upgrade[:-2] + b"x: y\r\n" * 200 + b"\r\n")  # 128 headers are allowed
    time.sleep(0.3)  # it is not answered, so nothing tells when it was read


@pytest.mark.parametrize(
    ("comes", "way", "flags"),
    [
        (says_goodbye_and_reads_nothing, "direct", ()),
        (says_goodbye_and_reads_nothing, "direct", ("--tls",)),
        (says_goodbye_and_reads_nothing, "asgi", ()),
        (is_refused_and_does_not_close, "direct", ("--tls",)),
        (asks_for_an_upgrade_that_the_parser_refuses, "direct", ()),
    ],
)
def test_the_process_ends_in_good_order_whoever_is_in_the_middle_of_leaving(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    comes: Callable[[Place], None],
    way: str,
    flags: tuple[str, ...],
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_SOCKETS", way)
    with started("editor", tmp_path, *flags) as (port, process), ExitStack() as stack:
        place = Place(stack, port, tls="--tls" in flags)
        honest = place.in_room()
        comes(place)
        process.terminate()
        heard = b""
        with contextlib.suppress(ssl.SSLEOFError):  # the process has ended without waiting for us
            while piece := honest.recv(1 << 16):
                heard += piece
        stack.close()  # else the process waits for their ends
        code = process.wait(20)
    assert heard.endswith(RESTARTING)
    assert code in {0, -signal.SIGTERM}
    assert "Traceback" not in (tmp_path / "log").read_text()


def spoken(said: bytes) -> tuple[_Http, Wire]:
    """A connection on which a client has said this."""

    async def app(_: object, __: object, ___: object) -> None:
        """Nobody comes so far."""

    config = uvicorn.Config(app, log_config=None)
    config.load()
    protocol, wire = _Http(config=config, server_state=ServerState(), app_state={}), Wire()
    protocol.connection_made(wire)
    protocol.data_received(said)
    return protocol, wire


async def test_a_refusal_that_is_still_going_out_is_not_cut_off() -> None:
    protocol, wire = spoken(CRUMBS)
    protocol.data_received(b"x" * 1000)  # its sender has not read it yet
    assert not wire.is_closing()
    protocol.shutdown()
    assert (wire.is_closing(), wire.is_cut_off) == (True, False)


async def test_an_idle_connection_is_closed() -> None:
    protocol, wire = spoken(b"GET / HTTP/1.1\r\n")
    protocol.shutdown()
    assert (wire.is_closing(), wire.is_cut_off) == (True, False)


async def test_a_fault_at_the_end_of_one_connection_affects_no_other(
    caplog: pytest.LogCaptureFixture,
) -> None:
    protocol, wire = spoken(b"GET / HTTP/1.1\r\n")
    protocol.conn.send_failed()  # behind the back of the protocol
    protocol.shutdown()
    assert wire.is_cut_off
    assert "LocalProtocolError" in caplog.text
    assert "Traceback" not in caplog.text
