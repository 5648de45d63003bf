"""Cookies ignore ports: whatever other programs of this computer set comes along, and never matters."""

import socket
import time
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from action_assistant.web.auth.access import cookie_values
from action_assistant.web.auth.keys import Keys, Person, Session
from web.auth.test_access import KEYS, served


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    folder = tmp_path_factory.mktemp("page")
    (folder / "index.html").write_text("<!doctype html>")
    with served(folder) as number:
        yield number


def ours(port: int, name: str = "Ada", expires: float = 1e12) -> bytes:
    sealed = KEYS.sealed(Session("s", Person("p", name, "owner"), expires))
    return f"aa_{port}={sealed}".encode()


def asked(port: int, *cookies: bytes, method: bytes = b"GET", path: bytes = b"/api/me") -> bytes:
    """The answer to a request with these Cookie lines, byte by byte as given."""
    lines = [
        method + b" " + path + b" HTTP/1.1",
        b"host: localhost:%d" % port,
        b"connection: close",
    ]
    lines += [b"origin: http://localhost:%d" % port, b"content-length: 0"]
    lines += [b"cookie: " + each for each in cookies]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as wire:
        wire.sendall(b"\r\n".join(lines) + b"\r\n\r\n")
        answer = b""
        while chunk := wire.recv(65536):
            answer += chunk
    return answer


FOREIGN = [
    b'g_state={"i_l":0}',
    b"a b=1",
    b"lang=\xe9",
    "lang=é".encode(),
    b'q="a;b"; r="',
    b"=empty",
    b"naked",
    b";;; ;",
    b"x=\\054\\",
    b"expires=Thu, 01 Jan 1970; path=/; secure",
    b"[a]=1; {b}=2; c(d)=3; @=4",
]


@pytest.mark.parametrize("foreign", FOREIGN)
@pytest.mark.parametrize("first", [True, False])
def test_cookies_of_other_programs_lock_nobody_out_of_anything(
    port: int, foreign: bytes, first: bool
) -> None:
    both = [foreign, ours(port)] if first else [ours(port), foreign]
    assert b" 200 " in asked(port, b"; ".join(both)).partition(b"\r\n")[0]
    assert b" 200 " in asked(port, *both).partition(b"\r\n")[0]
    stopped = asked(port, b"; ".join(both), method=b"POST", path=b"/api/stop")
    assert b" 200 " in stopped.partition(b"\r\n")[0]


@pytest.mark.parametrize("planted", [b"", b"x", b"a.b", b'"quoted.text"', b"%s." % (b"A" * 300)])
def test_a_planted_cookie_of_our_name_wins_nowhere(port: int, planted: bytes) -> None:
    fake = b"aa_%d=" % port + planted
    for line in ([fake, ours(port)], [ours(port), fake], [fake, ours(port), fake]):
        assert asked(port, b"; ".join(line)).endswith(b"Ada")
    others = Keys("o" * 43).sealed(Session("s", Person("q", "Eve", "owner"), 1e12)).encode()
    assert asked(port, b"aa_%d=%s" % (port, others), ours(port)).endswith(b"Ada")
    assert b" 401 " in asked(port, b"aa_%d=%s" % (port, others)).partition(b"\r\n")[0]


def test_the_first_valid_one_of_several_genuine_cookies_counts(port: int) -> None:
    over = ours(port, "Old", time.time() - 60)
    assert asked(port, b"; ".join([ours(port, "Ada"), ours(port, "Ben")])).endswith(b"Ada")
    assert asked(port, b"; ".join([over, ours(port, "Ada")])).endswith(b"Ada")
    assert b" 401 " in asked(port, over).partition(b"\r\n")[0]


def test_thousands_of_planted_cookies_cost_next_to_nothing() -> None:
    planted = "; ".join(f"aa_1={'A' * 20}.{'B' * 43}" for _ in range(2_000))
    assert len(list(cookie_values(planted, "aa_1"))) <= 100


@given(st.text(), st.text(alphabet="abc_", min_size=1), st.text(), st.text())
def test_our_value_is_found_beside_anything(before: str, name: str, after: str, value: str) -> None:
    value = "".join(each for each in value if each.isalnum())
    header = f"{before.replace(name, '')};{name}={value};{after.replace(name, '')}"
    assert value in list(cookie_values(header, name))
