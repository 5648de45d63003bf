"""Which hosts and origins are ours: exactly the listed ones."""

import pytest

from action_assistant.web.addresses import Addresses

LOCAL = Addresses(host="127.0.0.1", page_port=8000)
NAMED = Addresses(host="0.0.0.0", page_port=8000, hosts=("lab.example",))


@pytest.mark.parametrize(
    "host", ["localhost:8000", "127.0.0.1", "127.0.0.1:9", "[::1]:8000", "LOCALHOST:8000"]
)
def test_a_loopback_host_is_ours(host: str) -> None:
    assert LOCAL.allows_host(host)


@pytest.mark.parametrize(
    "host",
    [
        None,
        "",
        "evil.example",
        "localhost.evil.example",
        "127.0.0.1.evil.example",
        "user@localhost",
        "localhost:x",
        "localhost/",
        "localhost, evil.example",
        "localhost.",
        "0.0.0.0",
        "2130706433",
        "::1",
        "lab.example",
    ],
)
def test_any_other_host_is_not(host: str | None) -> None:
    assert not LOCAL.allows_host(host)


@pytest.mark.parametrize(
    "origin", ["http://localhost:8000", "http://127.0.0.1:8000", "http://[::1]:8000"]
)
def test_the_pages_own_origins_are_ours(origin: str) -> None:
    assert LOCAL.allows_origin(origin)


@pytest.mark.parametrize(
    "origin",
    [
        "null",
        "",
        "http://localhost",
        "http://localhost:8001",
        "https://localhost:8000",
        "http://evil.example:8000",
        "http://localhost.evil.example:8000",
        "http://evil@localhost:8000",
        "http://localhost:8000/",
        "http://localhost:8000?",
        "http://localhost:80000",
        "http://localhost:8000, http://evil.example",
        "file://",
        "ws://localhost:8000",
        "http://lab.example:8000",
    ],
)
def test_any_other_origin_is_not(origin: str) -> None:
    assert not LOCAL.allows_origin(origin)


def test_a_host_that_was_named_may_stand_behind_a_proxy() -> None:
    assert NAMED.allows_host("lab.example")
    assert NAMED.allows_origin("https://lab.example")
    assert not NAMED.allows_origin("https://other.example")
    assert not NAMED.allows_host("0.0.0.0:8000")
