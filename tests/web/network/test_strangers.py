"""Strangers, silent or not signed in, take no connection from people who are signed in."""

import contextlib
import resource
import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import httpx
import pytest

from support.product import TOKEN
from web.process import BEARER, UPGRADE, started

#: Descriptors that the process may have.
FEW = 256


@contextmanager
def process(name: str, folder: Path, *flags: str) -> Iterator[int]:
    """An editor or a runner that may have few descriptors."""
    with started(name, folder, *flags, descriptors=FEW) as (port, _):
        yield port


@pytest.fixture(autouse=True)
def many() -> None:
    """This process needs more descriptors than it asks for at first."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 8192), hard))


def strangers(stack: ExitStack, port: int, count: int, said: bytes = b"") -> list[socket.socket]:
    """Open `count` connections of strangers."""
    found = []
    for _ in range(count):
        one = stack.enter_context(socket.create_connection(("127.0.0.1", port), timeout=5))
        if said:
            one.send(said)
        found.append(one)
    return found


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("runner", b""),
        ("runner", b"POST /api/stop HTTP/1.1\r\nhost: localhost\r\nx-slow: "),
        ("editor", b""),
    ],
)
def test_idle_strangers_keep_nobody_from_coming_in(tmp_path: Path, name: str, said: bytes) -> None:
    with process(name, tmp_path) as port, ExitStack() as stack:
        url = f"http://127.0.0.1:{port}"
        before = stack.enter_context(httpx.Client(base_url=url, headers=BEARER, trust_env=False))
        path = "/api/robots" if name == "runner" else "/api/graphs"
        before.get(path).raise_for_status()
        strangers(stack, port, 2 * FEW, said)
        for _ in range(20):
            fresh = httpx.get(f"{url}{path}", headers=BEARER, trust_env=False, timeout=5)
            assert fresh.status_code == 200
            assert before.get(path).status_code == 200
            if name == "runner":
                stopped = httpx.post(f"{url}/api/stop", headers=BEARER, trust_env=False, timeout=5)
                assert stopped.status_code == 202


def test_strangers_who_do_not_even_finish_a_handshake_make_room_too(tmp_path: Path) -> None:
    with process("runner", tmp_path, "--tls") as port, ExitStack() as stack:
        strangers(stack, port, 2 * FEW)
        for _ in range(5):
            answer = httpx.post(
                f"https://127.0.0.1:{port}/api/stop",
                headers=BEARER,
                trust_env=False,
                verify=False,
                timeout=10,
            )
            assert answer.status_code == 202


def test_a_silent_connection_is_closed_and_one_that_waits_for_an_answer_is_not(
    tmp_path: Path,
) -> None:
    with process("runner", tmp_path) as port, ExitStack() as stack:
        (silent,) = strangers(stack, port, 1, b"GET /healthz HTTP/1.1\r\n")
        stream = b"GET /api/robots HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer %b\r\n\r\n"
        (known,) = strangers(stack, port, 1, stream % TOKEN.encode())
        assert known.recv(100).startswith(b"HTTP/1.1 200")
        silent.settimeout(30)
        assert silent.recv(100) == b""


def test_a_body_in_crumbs_is_refused(tmp_path: Path) -> None:
    """Each crumb would cost the loop more than it costs to send."""
    with process("runner", tmp_path) as port, ExitStack() as stack:
        head = (
            b"POST /api/session HTTP/1.1\r\nhost: localhost\r\ntransfer-encoding: chunked\r\n\r\n"
        )
        (one,) = strangers(stack, port, 1, head + b"1\r\nx\r\n" * 1000)
        assert one.recv(100).startswith(b"HTTP/1.1 411")


CUT_OFF = (
    b"POST /api/session HTTP/1.1\r\nhost: localhost\r\norigin: http://localhost:%d\r\n"
    b"content-type: application/json\r\ncontent-length: 50\r\n\r\n{"
)
UNFINISHED = (
    b"%b HTTP/1.1\r\nhost: localhost\r\nauthorization: Bearer %b\r\naccept: %b\r\n"
    b"content-length: 50\r\n\r\n{"
)
NO_TEXT = b"\x81\x82\0\0\0\0\xff\xff"


def test_unfinished_or_wrong_messages_of_a_peer_log_no_traceback(
    tmp_path: Path,
) -> None:
    """Each would write a traceback of dozens of lines, as often as anybody likes."""
    with process("editor", tmp_path) as port, ExitStack() as stack:
        url = f"http://127.0.0.1:{port}/api/graphs"
        made = httpx.post(url, json={"name": "g"}, headers=BEARER, trust_env=False).json()
        (one,) = strangers(stack, port, 1, CUT_OFF % port)
        time.sleep(0.3)  # nothing answers half a request, so nothing tells when it was read
        one.close()
        upgrade = UPGRADE % (made["id"].encode(), TOKEN.encode())
        (two,) = strangers(stack, port, 1, upgrade)
        assert two.recv(100).startswith(b"HTTP/1.1 101")
        two.send(NO_TEXT)
        while two.recv(4096):
            pass
        httpx.get(f"http://127.0.0.1:{port}/healthz", trust_env=False)
        time.sleep(0.3)
        log = (tmp_path / "log").read_text()
    assert "Invalid UTF-8" in log
    assert "Traceback" not in log
    assert "ended early" in log


@pytest.mark.parametrize(
    ("name", "asked", "accept"),
    [
        ("editor", b"GET /api/graphs", b"*/*"),
        ("editor", b"GET /healthz", b"*/*"),
        ("editor", b"GET /api/events?after=0", b"text/event-stream"),
        ("editor", b"GET /api/graphs/%b/umrf", b"*/*"),
        ("runner", b"GET /api/runs", b"*/*"),
        ("runner", b"GET /api/robots", b"*/*"),
        ("runner", b"DELETE /api/session", b"*/*"),
    ],
)
def test_a_body_that_nobody_asked_for_and_that_does_not_end_is_one_line(
    tmp_path: Path, name: str, asked: bytes, accept: bytes
) -> None:
    with process(name, tmp_path) as port, ExitStack() as stack:
        url = f"http://127.0.0.1:{port}"
        if b"%b" in asked:
            made = httpx.post(
                f"{url}/api/graphs", json={"name": "g"}, headers=BEARER, trust_env=False
            )
            asked %= made.json()["id"].encode()
        before = (tmp_path / "log").read_text().splitlines()
        for _ in range(3):
            (one,) = strangers(stack, port, 1, UNFINISHED % (asked, TOKEN.encode(), accept))
            time.sleep(0.3)  # a traceback would come when the request ends, which nothing tells
            one.close()
        time.sleep(0.3)
        httpx.get(f"{url}/healthz", trust_env=False)
        log = (tmp_path / "log").read_text()
    assert "Traceback" not in log
    assert len(log.splitlines()) <= len(before) + 4


SLOW = (
    b"POST /api/session HTTP/1.1\r\nhost: localhost\r\norigin: http://localhost:%d\r\n"
    b"x-forwarded-for: %b\r\ncontent-type: application/json\r\ncontent-length: 17\r\n\r\n{"
)


def slow(stack: ExitStack, port: int, source: str, asker: str) -> socket.socket:
    """A stranger who is in the middle of a request, as who comes from `source` passes it on."""
    one = stack.enter_context(
        socket.create_connection(("127.0.0.1", port), timeout=5, source_address=(source, 0))
    )
    one.send(SLOW % (port, asker.encode()))
    time.sleep(0.005)  # in the order in which they came, as the test counts them
    return one


def is_answered(one: socket.socket) -> bool:
    """Complete the request, and return whether it is answered."""
    with contextlib.suppress(OSError):
        one.send(b'"token":"wrong"}')
        return one.recv(100).startswith(b"HTTP/1.1 401")
    return False


@pytest.mark.parametrize(
    ("source", "asker"),
    [
        ("127.0.0.1", "198.51.100.1, 203.0.113.9"),
        ("127.0.0.3", "203.0.113.%d"),  # who is no proxy, and says of each that it is another one's
    ],
    ids=["behind the proxy", "forged"],
)
def test_a_client_that_floods_through_a_proxy_takes_nothing_from_others_behind_it(
    tmp_path: Path, source: str, asker: str
) -> None:
    with (
        process("editor", tmp_path, "--trusted-proxies", "127.0.0.1") as port,
        ExitStack() as stack,
    ):
        others = [slow(stack, port, "127.0.0.1", f"203.0.113.{n}") for n in range(100, 110)]
        for n in range(FEW):
            slow(stack, port, source, asker % n if "%" in asker else asker)
        assert [is_answered(each) for each in others] == [True] * 10
        fresh = slow(stack, port, "127.0.0.1", "203.0.113.200")
        assert is_answered(fresh)
        answer = httpx.get(
            f"http://127.0.0.1:{port}/api/graphs", headers=BEARER, trust_env=False, timeout=5
        )
        assert answer.status_code == 200


def test_an_address_that_is_too_long_is_a_refusal_that_its_sender_can_read(tmp_path: Path) -> None:
    with process("runner", tmp_path) as port, ExitStack() as stack:
        url = f"http://127.0.0.1:{port}/api/robots"
        for _ in range(20):  # that a reset takes the refusal away is a matter of chance
            (one,) = strangers(stack, port, 1, b"GET /" + b"a" * 400_000)
            one.sendall(b"a" * 400_000 + b" HTTP/1.1\r\nhost: localhost\r\n\r\n")
            assert b" 414 URI Too Long\r\n" in one.recv(1000)
        fields = {f"x-{n}": "a" * 50_000 for n in range(10)}
        assert httpx.get(url, headers=fields, trust_env=False).status_code == 431
        # Nobody goes on for ever.
        (endless,) = strangers(stack, port, 1, b"GET /" + b"a" * 400_000)
        with pytest.raises(OSError, match=r"reset|[Bb]roken pipe"):
            endless.sendall(b"a" * 100_000_000)
