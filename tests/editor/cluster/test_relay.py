"""Requests of a graph go to the editor that owns it, and nobody sees a difference."""

import asyncio
import contextlib
import http.client
import signal
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import psutil
import pytest
from pycrdt import Doc, Map

from editor.cluster.clients import closed
from editor.cluster.conftest import Pair, running_pair
from editor.process import BEARER
from journal.servers import Server
from support.waiting import wait_until


def things(doc: Doc[Any]) -> Map[Any]:
    return doc.get("meta", type=Map)


def present(client: httpx.Client, graph: str) -> list[Any]:
    """Return who has a graph open."""
    found: list[Any] = client.get(f"/api/graphs/{graph}").json().get("people", [])
    return found


def test_requests_about_a_graph_are_answered_by_its_owner(pair: Pair) -> None:
    graph = pair.new_graph()
    path = f"/api/graphs/{graph}"
    with pair.here.client() as here, pair.there.client() as there:
        assert here.get(path).json() == there.get(path).json()
        assert here.get(f"{path}/umrf").json() == there.get(f"{path}/umrf").json()
        changed = here.patch(path, json={"name": "née Ünïcode"})
        assert (changed.status_code, changed.json()["name"]) == (200, "née Ünïcode")
        assert there.get(path).json()["name"] == "née Ünïcode"
        missing = here.get(f"{path}/versions", params={"x": "a b/c'ü"})
        assert missing.json() == there.get(f"{path}/versions").json()
        for ask in (here, there):
            refused = ask.put(f"{path}/umrf", params={"seq": 999}, json={})
            assert (refused.status_code, refused.json()["type"]) == (409, "conflict")
        assert here.get("/api/graphs/nosuchgraph").status_code == 404
        plain = here.get(path, headers={"accept-encoding": "identity"})
        assert "content-encoding" not in plain.headers
        assert plain.headers["x-content-type-options"] == "nosniff"
        assert here.delete(path).status_code == 204
        assert there.get(path).status_code == 404


def test_what_is_of_no_graph_is_answered_here(pair: Pair) -> None:
    graph = pair.new_graph()
    with pair.here.client() as here:
        assert graph not in [each["id"] for each in here.get("/api/graphs").json()]
        assert here.get("/api/graphs/names").status_code == 200


@pytest.mark.parametrize("dots", ["..", "%2e%2e", "x/../..", "."])
def test_no_path_leads_out_of_what_is_of_the_graph(pair: Pair, dots: str) -> None:
    """The other editor takes edits of this one at addresses beside those of its API."""
    graph = pair.new_graph()
    inner = f"/api/graphs/{graph}/{dots}/{dots}/{dots}/rooms/graph%2F{graph}"
    for editor in (pair.here, pair.there):
        with contextlib.closing(http.client.HTTPConnection(editor.url[7:])) as plain:
            plain.request("GET", inner, headers=BEARER)
            assert plain.getresponse().status == 404


async def test_people_at_both_editors_are_in_one_room(pair: Pair) -> None:
    graph = pair.new_graph()
    ada, bob = Doc[Any](), Doc[Any]()
    async with pair.here.joined(graph, ada), pair.there.joined(graph, bob):
        for n in range(50):
            things(ada)[f"a{n}"] = float(n)
            things(bob)[f"b{n}"] = float(n)
        await wait_until(lambda: len([k for k in things(bob) if k[0] == "a"]) == 50)
        await wait_until(lambda: len([k for k in things(ada) if k[0] == "b"]) == 50)
    large = Doc[Any]()
    async with pair.here.joined(graph, large):
        assert things(large).to_py() == things(ada).to_py()


@pytest.mark.parametrize(
    ("message", "code"), [("text", 1003), (b"\x09", None), (b"\x00\x07", 1007)]
)
async def test_a_socket_is_closed_with_the_code_of_the_room(
    pair: Pair, message: str | bytes, code: int | None
) -> None:
    graph = pair.new_graph()
    async with pair.here.socket(graph) as socket:
        await (
            socket.send_text(message) if isinstance(message, str) else socket.send_bytes(message)
        )
        if code is None:
            code = 4404
            with pair.here.client() as here:
                gone = await asyncio.to_thread(here.delete, f"/api/graphs/{graph}")
            assert gone.status_code == 204
        assert await closed(socket) == code


async def test_an_upgrade_is_refused_as_the_owner_refuses_it(pair: Pair) -> None:
    with pytest.raises(httpx_ws.WebSocketUpgradeError) as refused:
        async with pair.here.socket("nosuchgraph"):
            pass
    assert refused.value.response.status_code == 404


async def test_a_client_that_leaves_leaves_the_room(pair: Pair) -> None:
    graph = pair.new_graph()
    with pair.there.client() as there:
        assert not present(there, graph)
        async with pair.here.socket(graph) as socket:
            # A presence entry: client 7, clock 1, {}.
            await socket.send_bytes(bytes([1, 6, 1, 7, 1, 2]) + b"{}")
            await wait_until(lambda: present(there, graph))
        await wait_until(lambda: not present(there, graph))


async def test_the_sockets_of_a_killed_owner_come_back_as_soon_as_somebody_owns_the_graph(
    tmp_path: Path, postgres: Server
) -> None:
    with running_pair(tmp_path, postgres) as pair:
        graph = pair.new_graph()
        async with pair.here.socket(graph) as socket:
            pair.there.kill()
            assert await closed(socket) == 1012
        with pair.here.client() as here:
            gone = here.get(f"/api/graphs/{graph}")
            assert (gone.status_code, gone.json()["type"]) == (503, "unavailable")
            pair.give("*", pair.here)
            assert here.get(f"/api/graphs/{graph}").status_code == 404  # its own database answers


def connections(pair: Pair) -> int:
    """Return how many connections `here` has to the other editor, in whichever state."""
    port = httpx.URL(pair.there.inner).port
    found = psutil.Process(pair.here.process.pid).net_connections("tcp4")
    return sum(bool(each.raddr) and each.raddr.port == port for each in found)


async def test_sockets_leave_an_owner_that_stands_still_once_another_has_the_graph(
    tmp_path: Path, postgres: Server
) -> None:
    with running_pair(tmp_path, postgres) as pair:
        graph, other = pair.new_graph(), pair.new_graph()
        async with pair.here.socket(graph) as socket, pair.here.socket(other) as second:
            pair.there.process.send_signal(signal.SIGSTOP)
            sockets = connections(pair)
            with pair.here.client() as here:
                asking = asyncio.create_task(asyncio.to_thread(here.get, f"/api/graphs/{graph}"))
                changing = asyncio.create_task(
                    asyncio.to_thread(here.patch, f"/api/graphs/{graph}", json={"name": "new"})
                )
                await wait_until(lambda: connections(pair) >= sockets + 2)
                pair.give("*", pair.here)
                assert await closed(socket) == await closed(second) == 1012
                assert (await asking).status_code == 404  # of the new owner
                lost = await changing
                assert (lost.status_code, lost.json()["type"]) == (504, "outcome-unknown")


async def test_a_revoked_session_ends_at_both(pair: Pair) -> None:
    graph = pair.new_graph()
    async with httpx.AsyncClient(base_url=pair.here.url, trust_env=False) as browser:
        origin = {"origin": pair.here.url}
        came = await browser.post(
            "/api/session",
            json={"token": BEARER["authorization"][7:], "name": "Ada"},
            headers=origin,
        )
        assert came.status_code in {200, 201, 204}, came.text
        cookie = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
        with pair.there.client() as there:
            async with pair.here.socket(graph, cookie=cookie, **origin) as socket:
                await socket.send_bytes(bytes([1, 6, 1, 7, 1, 2]) + b"{}")
                await wait_until(lambda: present(there, graph))
                left = await browser.delete("/api/session", headers=origin)
                assert left.status_code == 204
                assert await closed(socket) == 4401
                await wait_until(lambda: not present(there, graph))
