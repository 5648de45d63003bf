"""The server accepts exactly the listed hosts and origins."""

import pytest

from action_assistant.web.network.addresses import Addresses, host_name, lan_names

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


def test_a_shared_computer_answers_to_its_names_of_now_and_no_others() -> None:
    network = ["10.0.0.2", "lab.local"]
    shared = Addresses(host="*", page_port=8000, lan=lambda: tuple(network))
    for name in (*network, "localhost"):
        assert shared.allows_host(f"{name}:8000")
        assert shared.allows_origin(f"http://{name}:8000")
        assert not shared.allows_origin(f"http://{name}:8001")
        assert not shared.allows_origin(f"https://{name}:8000")
    for other in ("10.0.0.3", "evil.local", "0.0.0.0", "*"):
        assert not shared.allows_host(other)
    assert shared.origins() == ("http://10.0.0.2:8000", "http://lab.local:8000")


def test_another_network_needs_no_restart_and_strangers_cannot_make_us_look_all_the_time() -> None:
    networks = iter([("10.0.0.2",), ("10.9.9.9",), ("10.7.7.7",)])
    now = 0.0
    shared = Addresses(host="*", page_port=8000, lan=lambda: next(networks), clock=lambda: now)
    assert not shared.allows_host("10.9.9.9")  # too soon to look again
    now = 6.0
    assert shared.allows_host("10.9.9.9")
    assert not shared.allows_host("10.0.0.2")
    assert not shared.allows_host("10.7.7.7")


def test_under_tls_only_pages_that_came_by_it_may_call() -> None:
    secure = Addresses(host="*", page_port=8000, secure=True, lan=lambda: ("fd00::2",))
    assert secure.allows_origin("https://[fd00::2]:8000")
    assert not secure.allows_origin("http://[fd00::2]:8000")
    assert secure.origins() == ("https://[fd00::2]:8000",)
    assert secure.certified() == ("127.0.0.1", "::1", "localhost", "fd00::2")


def test_this_computer_names_itself_by_what_others_can_reach() -> None:
    found = lan_names()
    assert len(set(found)) == len(found)
    for name in found:
        assert host_name(f"[{name}]" if ":" in name else name) == name
        assert not name.startswith(("127.", "fe80", "169.254."))
