"""Different clients in one room of the real server: the page, a stock y-websocket, pycrdt's own."""

import os
import shutil
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from typing import Any, TypeVar

import anyio
import httpx
import pytest
from httpx_ws import aconnect_ws
from pycrdt import Doc, Map, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from action_assistant.editor.documents import document
from action_assistant.umrf.model import Graph
from support.page import Page, graph_of, open_page
from support.product import TOKEN, Product, running

#: Seconds for which the idle test is quiet. The fault of silent sockets shows after 30 s.
IDLE_SECONDS = float(os.environ.get("TEST_IDLE_SECONDS", "2"))

T = TypeVar("T")


@pytest.fixture(scope="module")
def product(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Product]:
    with running(tmp_path_factory.mktemp("product") / "data") as product:
        yield product


@pytest.fixture
def page() -> Iterator[Page]:
    with open_page() as page:
        yield page


@pytest.fixture
def graph_id(product: Product) -> str:
    with product.editor() as client:
        answer = client.post("/api/graphs", json={"name": "shared"})
        assert answer.status_code == 201, answer.text
        found: str = answer.json()["id"]
        return found


def room_of(product: Product, graph_id: str) -> str:
    return f"{product.url.replace('http', 'ws')}/api/graphs/{graph_id}"


def join(page: Page, product: Product, graph_id: str, name: str) -> None:
    page("join", name=name, url=f"{room_of(product, graph_id)}/room", token=TOKEN)
    until(lambda: page("look", name=name)["link"]["state"] == "live", True)


def join_stock(page: Page, product: Product, graph_id: str, name: str) -> None:
    page("joinStock", name=name, base=room_of(product, graph_id), token=TOKEN)
    until(lambda: page("look", name=name)["link"]["state"] == "live", True)


@asynccontextmanager
async def joined(product: Product, graph_id: str) -> AsyncIterator[Doc]:  # type: ignore[type-arg]
    """pycrdt's own provider, as the command line uses it."""
    doc: Doc = Doc()  # type: ignore[type-arg]
    async with AsyncExitStack() as stack:
        client = await stack.enter_async_context(httpx.AsyncClient(trust_env=False))
        address = f"{product.url}/api/graphs/{graph_id}/room"
        headers = {"authorization": f"Bearer {TOKEN}"}
        socket = await stack.enter_async_context(aconnect_ws(address, client, headers=headers))
        await stack.enter_async_context(Provider(doc, HttpxWebsocket(socket, address)))
        yield doc


def until(see: Callable[[], T], wanted: T, seconds: float = 15) -> None:
    """Waits until something is seen."""
    deadline = time.monotonic() + seconds
    while (seen := see()) != wanted:
        if time.monotonic() > deadline:
            assert seen == wanted
        time.sleep(0.02)


def seen(page: Page, name: str) -> Graph:
    return graph_of(page("look", name=name)["graph"])


def names(graph: Graph) -> list[str]:
    return sorted(action.full_name for action in graph.actions)


async def test_three_kinds_of_clients_see_the_same(
    page: Page, product: Product, graph_id: str
) -> None:
    join(page, product, graph_id, "page")
    join_stock(page, product, graph_id, "stock")
    async with joined(product, graph_id) as doc:
        page("act", name="page", edit=["addAction", {"name": "OfPage"}])
        page("act", name="stock", edit=["addAction", {"name": "OfStock"}])
        doc.get("actions", type=Map)[document.new_aid()] = "OfPython"
        wanted = ["OfPage_0", "OfPython_0", "OfStock_0"]
        with anyio.fail_after(15):
            while names(document.read(doc)) != wanted:  # noqa: ASYNC110 - pycrdt has no event for it
                await anyio.sleep(0.02)
        until(lambda: names(seen(page, "page")), wanted)
        until(lambda: names(seen(page, "stock")), wanted)
        assert seen(page, "page") == seen(page, "stock") == document.read(doc)


def test_edits_that_the_page_calls_saved_are_in_the_log(
    page: Page, product: Product, graph_id: str
) -> None:
    join(page, product, graph_id, "page")
    for n in range(5):
        page("act", name="page", edit=["addAction", {"name": f"A{n}"}])
    until(lambda: page("look", name="page")["link"]["unsaved"], 0)
    seq = page("look", name="page")["link"]["seq"]
    with product.editor() as client:
        assert client.get(f"/api/graphs/{graph_id}").json()["seq"] == seq
        file = client.get(f"/api/graphs/{graph_id}/umrf", params={"at": seq}).json()
    assert sorted(action["name"] for action in file["actions"]) == [f"A{n}" for n in range(5)]


def test_the_server_vouches_for_the_person_in_presence(
    page: Page, product: Product, graph_id: str
) -> None:
    join(page, product, graph_id, "page")
    join_stock(page, product, graph_id, "stock")
    liar = {"user": {"id": "someone else", "name": "Mallory"}, "selection": ["a"]}
    page("say", name="stock", state=liar)
    client = str(page("look", name="stock")["client"])

    def state() -> Any:
        return page("look", name="page")["states"].get(client, {})

    until(lambda: state().get("selection"), ["a"])
    assert state()["user"]["id"] != "someone else"
    page("leave", name="stock")
    until(lambda: state(), {})


def test_an_idle_client_is_not_dropped(page: Page, product: Product, graph_id: str) -> None:
    join(page, product, graph_id, "page")
    join_stock(page, product, graph_id, "stock")
    deadline = time.monotonic() + IDLE_SECONDS
    while time.monotonic() < deadline:
        assert page("look", name="page")["link"]["state"] == "live"
        time.sleep(0.25)
    assert page("look", name="stock")["drops"] == 0
    page("act", name="stock", edit=["addAction", {"name": "StillHere"}])
    until(lambda: names(seen(page, "page")), ["StillHere_0"])


def test_a_page_that_shows_something_else_notices_and_the_server_counts_it(
    page: Page, product: Product, graph_id: str
) -> None:
    def counted() -> float:
        with product.editor() as client:
            lines = client.get("/metrics").text.splitlines()
        (line,) = (each for each in lines if each.startswith("action_assistant_divergences_total "))
        return float(line.split()[1])

    for name in ("sound", "twisted"):
        join(page, product, graph_id, name)
    page("twist", name="twisted", text="something else")
    page("act", name="sound", edit=["setGraphDescription", "moved on"])
    until(lambda: page("look", name="twisted")["link"].get("why"), "differs", seconds=20)
    assert page("look", name="sound")["link"]["state"] == "live"
    assert counted() == 1
    for name in ("sound", "twisted"):
        page("leave", name=name)


@pytest.mark.long
def test_edits_made_while_the_server_was_gone_are_saved_when_it_is_back(
    page: Page, tmp_path: Path
) -> None:
    product = Product(tmp_path / "data")
    product.start()
    try:
        with product.editor() as client:
            graph_id = client.post("/api/graphs", json={"name": "g"}).json()["id"]
        join(page, product, graph_id, "page")
        page("act", name="page", edit=["addAction", {"name": "Before"}])
        product.kill()
        until(lambda: page("look", name="page")["link"]["state"], "offline")
        page("act", name="page", edit=["addAction", {"name": "While"}])
        assert page("look", name="page")["link"]["unsaved"] >= 1
        product.start()
        until(lambda: page("look", name="page")["link"]["unsaved"], 0, seconds=30)
        with product.editor() as client:
            file = client.get(f"/api/graphs/{graph_id}/umrf").json()
        assert sorted(action["name"] for action in file["actions"]) == ["Before", "While"]
    finally:
        product.end()


def test_a_page_never_brings_back_what_a_restored_backup_lacks(page: Page, tmp_path: Path) -> None:
    product = Product(tmp_path / "data")
    product.start()
    try:
        with product.editor() as client:
            graph_id = client.post("/api/graphs", json={"name": "g"}).json()["id"]
        join(page, product, graph_id, "page")
        page("act", name="page", edit=["addAction", {"name": "Before"}])
        until(lambda: page("look", name="page")["link"]["unsaved"], 0)
        product.kill()
        shutil.copytree(product.data, tmp_path / "backup")
        product.start()
        until(lambda: page("look", name="page")["link"]["state"], "live", seconds=30)
        page("act", name="page", edit=["addAction", {"name": "LostWithTheDisk"}])
        until(lambda: page("look", name="page")["link"]["unsaved"], 0)
        product.kill()
        page("act", name="page", edit=["addAction", {"name": "Waits"}])
        shutil.rmtree(product.data)
        shutil.copytree(tmp_path / "backup", product.data)
        product.start()
        until(lambda: page("look", name="page")["link"].get("why"), "other-epoch", seconds=30)
        assert page("look", name="page")["link"]["unsaved"] == 1
        with product.editor() as client:
            file = client.get(f"/api/graphs/{graph_id}/umrf").json()
        assert [action["name"] for action in file["actions"]] == ["Before"]
    finally:
        product.end()
