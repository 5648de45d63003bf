"""The editor on a real Postgres: what is acknowledged stays, and it goes on by itself."""

import asyncio
import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map
from wsproto.utilities import LocalProtocolError

from action_assistant.editor.crdt import messages
from editor.process import Editor, running
from journal.servers import Server, binaries, server


@pytest.fixture
def mortal() -> Iterator[Server]:
    """A server that a test may stop."""
    if binaries() is None:
        pytest.skip("Postgres is not installed (Debian: postgresql)")
    with server() as one:
        yield one


class Hand:
    """A client who writes things into a graph, and reconnects until they are durable, for so many
    seconds (`patience`)."""

    def __init__(self, editor: Editor, graph: str, *, patience: float = 40) -> None:
        self.doc: Doc[Any] = Doc()
        self.things = self.doc.get("things", type=Map)
        self.turned_away = 0
        self._editor = editor
        self._graph = graph
        self._patience = patience

    async def write(self, name: str) -> None:
        """Write a thing, and wait until it is acknowledged."""
        self.things[name] = name
        async with asyncio.timeout(self._patience):
            while not await self._acknowledged():
                self.turned_away += 1
                await asyncio.sleep(0.1)

    async def _acknowledged(self) -> bool:
        """Return whether the edit was acknowledged over one connection."""
        with contextlib.suppress(ConnectionError):
            try:
                async with self._editor.socket(self._graph, "?acks=1") as session:
                    await self._converse(session)
                    return True
            except* (
                httpx_ws.HTTPXWSException,
                httpx.TransportError,
                LocalProtocolError,  # it closes while something is being sent
            ) as gone:
                raise ConnectionError from gone
        return False

    async def _converse(self, session: httpx_ws.AsyncWebSocketSession) -> None:
        await session.send_bytes(messages.question(self.doc.get_state()))
        while True:
            frame = await session.receive_bytes()
            if frame[0] == messages.ACKS and messages.ByteReader(frame[1:]).number() > 0:
                return
            match frame[0] == messages.SYNC and messages.parse(frame):
                case messages.Question(state):
                    await session.send_bytes(messages.answer(self.doc.get_update(state)))
                case messages.Edit(update):
                    self.doc.apply_update(update)


async def seen(editor: Editor, graph: str) -> set[str]:
    """Return the things that a new client receives."""
    doc: Doc[Any] = Doc()
    things = doc.get("things", type=Map)
    async with editor.joined(graph, doc):
        return set(things.keys())


def made(editor: Editor) -> str:
    with editor.client() as client:
        graph: str = client.post("/api/graphs", json={"name": "on Postgres"}).json()["id"]
    return graph


async def test_after_a_kill_everything_acknowledged_is_there(
    postgres: Server, tmp_path: Path
) -> None:
    with running(tmp_path / "data", postgres.new_database()) as editor:
        graph = await asyncio.to_thread(made, editor)
        hand = Hand(editor, graph)
        for n in range(3):
            await hand.write(f"before {n}")
        await asyncio.to_thread(editor.kill)
        await asyncio.to_thread(editor.start)
        assert await seen(editor, graph) == {"before 0", "before 1", "before 2"}
        with editor.client() as client:
            listed = (await asyncio.to_thread(client.get, "/api/graphs")).json()
        assert "on Postgres" in [each["name"] for each in listed]


async def test_the_editor_goes_on_by_itself_when_postgres_is_back(
    mortal: Server, tmp_path: Path
) -> None:
    with running(tmp_path / "data", mortal.new_database()) as editor:
        graph = await asyncio.to_thread(made, editor)
        hand = Hand(editor, graph)
        await hand.write("before")
        await asyncio.to_thread(mortal.stop, "immediate")
        with editor.client() as client:  # it tries a write once a second at most
            while (await asyncio.to_thread(client.get, "/readyz")).status_code != 503:  # noqa: ASYNC110 - nobody tells
                await asyncio.sleep(0.1)
        waiting = asyncio.create_task(hand.write("while it was away"))
        while hand.turned_away == 0:  # noqa: ASYNC110 - nobody tells
            await asyncio.sleep(0.02)
        await asyncio.to_thread(mortal.start)
        await waiting
        await hand.write("after")
        assert await seen(editor, graph) == {"before", "while it was away", "after"}


def test_the_past_is_asked_of_postgres_as_of_a_file(postgres: Server, tmp_path: Path) -> None:
    database = postgres.new_database()
    with running(tmp_path / "data", database) as editor, editor.client() as http:
        graph = http.post("/api/graphs", json={"name": "task"}).json()["id"]
        for name in ("second", "third"):
            http.patch(f"/api/graphs/{graph}", json={"name": name})
        below = f"/api/graphs/{graph}"
        edited, created = http.get(f"{below}/history").json()
        assert edited["changes"]["fields"] == [
            {"field": "name", "before": "task", "after": "third"}
        ]
        assert created["kind"] == "created"
        assert http.get(f"{below}/document", params={"at": 2}).json()["meta"]["name"] == "second"
        (name,) = [
            each
            for each in http.get(f"{below}/blame", params={"of": ""}).json()
            if each["field"] == "name"
        ]
        assert (name["value"], name["before"], name["seq"]) == ("third", "second", 3)
        back = {"author": "local", "from_seq": 2, "seq": 3}
        assert http.post(f"{below}/revert", json=back).json() == {"seq": 4, "left": []}
        assert http.get(f"{below}/umrf").json()["graph_name"] == "task"
