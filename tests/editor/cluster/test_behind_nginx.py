"""Three editors behind the documented nginx: whoever comes by it sees one server, also when an editor is killed."""

import asyncio
import contextlib
import ssl
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import pytest

from editor.cluster.several import OneOfSeveral, started
from editor.cluster.test_relay import until
from editor.cluster.test_several_editors import Stubborn
from editor.process import BEARER
from journal.servers import Server
from support.product import free_ports
from support.proxy import EDITORS, NGINX, nginx

pytestmark = pytest.mark.skipif(not NGINX, reason="nginx is not installed")


class ByProxy:
    """The way through nginx."""

    def __init__(self, url: str, chain: Path) -> None:
        self.url = url
        self.trust = ssl.create_default_context(cafile=str(chain))

    @contextlib.asynccontextmanager
    async def socket(self, graph: str) -> AsyncIterator[httpx_ws.AsyncWebSocketSession]:
        """A socket into a room."""
        room = f"{self.url.replace('https', 'wss', 1)}/api/graphs/{graph}/room"
        async with (
            httpx.AsyncClient(verify=self.trust, trust_env=False) as client,
            httpx_ws.aconnect_ws(room, client, headers={**BEARER}) as session,
        ):
            yield session


async def test_a_killed_editor_is_not_missed_behind_the_documented_nginx(
    tmp_path: Path, postgres: Server
) -> None:
    port, database = free_ports(), postgres.new_database()
    url = f"https://localhost:{port}"
    data = tmp_path / "data"
    editors = [
        OneOfSeveral(data, database, n, f"127.0.0.{n + 1}", "--public-url", url) for n in range(3)
    ]
    for each in editors[1:]:
        each.port = editors[0].port
    with (
        started(editors),
        nginx(
            tmp_path / "proxy",
            name="localhost",
            port=port,
            editor=editors[0].port,
            documented=EDITORS,
        ) as chain,
    ):
        way = ByProxy(url, chain)
        async with httpx.AsyncClient(
            base_url=url, verify=way.trust, trust_env=False, timeout=20
        ) as page:
            origin = {"origin": url}
            token = BEARER["authorization"][7:]
            came = await page.post(
                "/api/session", json={"token": token, "name": "Ada"}, headers=origin
            )
            assert came.is_success, came.text
            graphs: list[str] = []
            for n in range(4):
                made = await page.post("/api/graphs", json={"name": f"g{n}"}, headers=origin)
                graphs.append(made.json()["id"])
            ways: list[Any] = [way]
            people = {
                graph: [Stubborn(f"{n}", ways, 0, graph) for n in range(3)] for graph in graphs
            }
            for round_ in range(60):
                for some in people.values():
                    some[round_ % 3].write()
                await asyncio.sleep(0.05)
                if round_ == 20:
                    editors[1].kill()
                if round_ == 40:
                    editors[0].kill()
            for some in people.values():
                keys = set().union(*(each.written for each in some))
                await until(lambda some=some, keys=keys: all(each.has(keys) for each in some), 90)
            for some in people.values():
                for each in some:
                    await each.aclose()
            listed = await page.get("/api/graphs")
            assert {each["id"] for each in listed.json()} >= set(graphs)
            assert (await page.get("/api/session")).is_success
