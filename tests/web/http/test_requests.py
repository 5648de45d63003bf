"""Ids of requests: only a proxy that is believed may give them, and all that a request does has its own."""

from typing import Any

import anyio
import pytest

from action_assistant.logs import begin, subjects
from action_assistant.public_url import proxies
from action_assistant.web.http.requests import RequestCounts, Requests
from action_assistant.web.server.proxy import Forwarded


def asked(peer: str, name: bytes, path: str = "/api/me") -> tuple[dict[str, str], RequestCounts]:
    """Return the subjects of log lines during a request that brings an id of its own."""
    seen: dict[str, str] = {}
    counts = RequestCounts()

    async def app(scope: Any, receive: Any, send: Any) -> None:
        seen.update(subjects())
        assert counts.open["http"] == 1
        await send({"type": "http.response.start", "status": 204, "headers": []})

    async def nothing(*_: Any) -> None:
        """Nobody listens."""

    scope: Any = {
        "type": "http",
        "method": "GET",
        "path": path,
        "client": (peer, 1),
        "headers": [(b"X-Request-ID", name)],
        "state": {},
    }
    believed = Forwarded(Requests(app, counts), proxies("10.0.0.0/8"))
    begin({})
    anyio.run(believed, scope, nothing, nothing)
    return seen, counts


def test_a_proxy_that_is_believed_names_a_request() -> None:
    assert asked("10.0.0.1", b"4f-ab.12:3")[0] == {"request": "4f-ab.12:3"}


@pytest.mark.parametrize(
    ("peer", "name"),
    [
        ("192.168.0.1", b"mine"),
        ("10.0.0.1", b""),
        ("10.0.0.1", b"two words"),
        ("10.0.0.1", b"line\nfeed"),
        ("10.0.0.1", b"x" * 65),
        ("10.0.0.1", "ä".encode()),
    ],
)
def test_else_it_has_a_name_of_our_own(peer: str, name: bytes) -> None:
    found = asked(peer, name)[0]["request"]
    assert found != name.decode()
    assert len(found) == 16


@pytest.mark.parametrize(
    ("path", "about"),
    [
        ("/api/runs/R1/stop", {"run": "R1"}),
        ("/api/graphs/G1", {"graph": "G1"}),
        ("/api/graphs", {}),
        ("/api/runs/" + "x" * 65, {}),
    ],
)
def test_lines_are_about_what_the_path_names(path: str, about: dict[str, str]) -> None:
    found, counts = asked("10.0.0.1", b"r", path)
    assert found == {"request": "r", **about}
    assert counts.answered == {204: 1}
    assert counts.open["http"] == 0
