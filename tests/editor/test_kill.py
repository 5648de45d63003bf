"""kill -9 in the middle of everything: what was acknowledged or seen is there afterwards."""

import asyncio
import random
from pathlib import Path
from typing import Any, Final

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map
from wsproto.utilities import LocalProtocolError

from action_assistant.editor import wire
from action_assistant.editor.replica import load
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from editor.process import Editor, running

WRITERS: Final = 3
KILLS: Final = 4


class Writer:
    """Writes numbered things as fast as it is acknowledged, and remembers what must be there."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.doc: Doc[Any] = Doc()
        self.map = self.doc.get("things", type=Map)
        self.written = 0
        self.acknowledged = 0
        self.seen: set[str] = set()
        self._made: list[bytes] = []
        self._subscription = self.doc.observe(lambda event: self._made.append(event.update))

    async def write(self, editor: Editor, graph: str) -> None:
        """Until the server dies."""
        try:
            async with editor.socket(graph, "?acks=1") as session:
                await session.send_bytes(wire.question(self.doc.get_state()))
                await self._converse(session)
        except* (httpx_ws.HTTPXWSException, httpx.TransportError, LocalProtocolError, OSError):
            pass

    async def _converse(self, session: httpx_ws.AsyncWebSocketSession) -> None:
        sent: list[int] = []  # how much was written when each message left
        while True:
            frame = await session.receive_bytes()
            if frame[0] == wire.ACKS:
                durable = wire.Reader(frame[1:]).number()
                self.acknowledged = max([self.acknowledged, *sent[:durable]])
                for _ in range(random.randint(1, 4)):
                    sent.append(await self._next(session))
                continue
            match wire.parse(frame):
                case wire.Question(state):
                    await session.send_bytes(wire.answer(self.doc.get_update(state)))
                    sent.append(self.written)
                case wire.Edit(update):
                    self.doc.apply_update(update)
                    self.seen = {key for key in self.map if not key.startswith(self.name)}

    async def _next(self, session: httpx_ws.AsyncWebSocketSession) -> int:
        self.written += 1
        self._made.clear()
        self.map[f"{self.name}{self.written}"] = self.written
        await session.send_bytes(wire.change(self._made[0]))
        return self.written


async def stored(data: Path, graph: str) -> set[str]:
    """What the log of a dead editor holds."""
    journal = await Journal.open(f"sqlite:///{data / 'editor.db'}", branch="editor", fold=nothing)
    loaded = await load(journal, f"graph/{graph}")
    things = set(loaded.replica.doc.get("things", type=Map).keys())
    events = await journal.read(f"graph/{graph}")
    assert [event.seq for event in events] == list(range(1, len(events) + 1))
    loaded.replica.close()
    await journal.close()
    return things


@pytest.mark.slow
async def test_nothing_acknowledged_or_seen_is_lost(tmp_path: Path) -> None:
    with running(tmp_path / "data") as editor:
        with editor.client() as client:
            made = await asyncio.to_thread(client.post, "/api/graphs", json={"name": "load"})
        graph: str = made.json()["id"]
        writers = [Writer(name) for name in "abc"[:WRITERS]]
        for kill in range(KILLS):
            tasks = [asyncio.create_task(writer.write(editor, graph)) for writer in writers]
            await asyncio.sleep(random.uniform(0.3, 1.0))
            await asyncio.to_thread(editor.kill)
            await asyncio.wait_for(asyncio.gather(*tasks), 20)
            things = await stored(editor.data, graph)
            for writer in writers:
                assert writer.acknowledged > 0, kill
                must = {f"{writer.name}{n}" for n in range(1, writer.acknowledged + 1)}
                assert must <= things
                assert writer.seen <= things
            await asyncio.to_thread(editor.start)
