"""kill -9 in the middle of everything: what was acknowledged or seen is there afterwards."""

import asyncio
import contextlib
import itertools
import os
import random
import signal
import sqlite3
import sys
from pathlib import Path
from typing import Any, Final

import httpx
import httpx_ws
import pytest
from pycrdt import Doc, Map
from wsproto.utilities import LocalProtocolError

from action_assistant.editor.crdt import messages
from action_assistant.editor.crdt.loading import load
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from editor.dying_rooms import NOWHERE, POINTS, Pipe
from editor.process import Editor, running
from support.waiting import wait_until

WRITERS: Final = 3
KILLS: Final = 4
SMALL_KILLS: Final = int(os.environ.get("TEST_KILLS", "24"))
_SHARING: Final = 5  # kills in a row that hit the same graph


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
        """Write until the server dies."""
        try:
            async with editor.socket(graph, "?acks=1") as session:
                await session.send_bytes(messages.question(self.doc.get_state()))
                await self.serve_by_asgi(session)
        except* (httpx_ws.HTTPXWSException, httpx.TransportError, LocalProtocolError, OSError):
            pass

    async def write_to(self, pipe: Pipe) -> None:
        """Write until the small process dies."""
        try:
            await pipe.send_bytes(self.name.encode())
            await pipe.send_bytes(messages.question(self.doc.get_state()))
            await self.serve_by_asgi(pipe)
        except (asyncio.IncompleteReadError, ConnectionError):
            pipe.close()

    async def serve_by_asgi(self, session: httpx_ws.AsyncWebSocketSession | Pipe) -> None:
        sent: list[int] = []  # how much was written when each message left
        while True:
            frame = await session.receive_bytes()
            if frame[0] == messages.ACKS:
                durable = messages.ByteReader(frame[1:]).number()
                self.acknowledged = max([self.acknowledged, *sent[:durable]])
                for _ in range(random.randint(1, 4)):
                    sent.append(await self._next(session))
                continue
            match messages.parse(frame):
                case messages.Question(state):
                    await session.send_bytes(messages.answer(self.doc.get_update(state)))
                    sent.append(self.written)
                case messages.Edit(update):
                    self.doc.apply_update(update)
                    self.seen = {key for key in self.map if not key.startswith(self.name)}

    async def _next(self, session: httpx_ws.AsyncWebSocketSession | Pipe) -> int:
        self.written += 1
        self._made.clear()
        self.map[f"{self.name}{self.written}"] = self.written
        await session.send_bytes(messages.change(self._made[0]))
        return self.written


async def stored(data: Path, graph: str) -> set[str]:
    """Return the things in the log of a dead editor."""
    journal = await Journal.open(f"sqlite:///{data / 'editor.db'}", branch="editor", fold=nothing)
    loaded = await load(journal, f"graph/{graph}")
    things = set(loaded.replica.doc.get("things", type=Map).keys())
    events = await journal.read(f"graph/{graph}")
    assert [event.seq for event in events] == list(range(1, len(events) + 1))
    await journal.close()
    return things


@pytest.mark.slow
async def test_nothing_acknowledged_or_seen_is_lost(tmp_path: Path) -> None:
    with running(tmp_path / "data") as editor:
        with editor.client() as client:
            made = await asyncio.to_thread(client.post, "/api/graphs", json={"name": "load"})
        graph: str = made.json()["id"]
        writers = [Writer(name) for name in "abc"[:WRITERS]]
        for _ in range(KILLS):
            tasks = [asyncio.create_task(writer.write(editor, graph)) for writer in writers]
            for writer in writers:  # on a busy machine the first word takes its time
                await wait_until(lambda writer=writer: writer.acknowledged > 0)
            await asyncio.sleep(random.uniform(0.3, 1.0))
            await asyncio.to_thread(editor.kill)
            await asyncio.wait_for(asyncio.gather(*tasks), 20)
            things = await stored(editor.data, graph)
            for writer in writers:
                must = {f"{writer.name}{n}" for n in range(1, writer.acknowledged + 1)}
                assert must <= things
                assert writer.seen <= things
            await asyncio.to_thread(editor.start)


class Mortal:
    """The process that makes processes which die."""

    def __init__(self, process: asyncio.subprocess.Process, folder: Path) -> None:
        self._process = process
        self._folder = folder
        self.child = 0

    @classmethod
    async def begun(cls, folder: Path) -> "Mortal":
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "editor.dying_rooms", str(folder)),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        return cls(process, folder)

    async def bear(self, stream: str, point: str, count: int) -> None:
        """A process that serves a room and dies at a point."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{stream} {count} {point}\n".encode())
        self.child = int(await self._line())

    async def connected(self) -> Pipe:
        while not (self._folder / "socket").exists():  # noqa: ASYNC110 - another process makes it
            await asyncio.sleep(0.005)
        return Pipe(*await asyncio.open_unix_connection(self._folder / "socket"))

    async def dead(self) -> None:
        """Wait until it is; by SIGKILL and nothing else."""
        assert await asyncio.wait_for(self._line(), 30) == b"dead\n"

    async def _line(self) -> bytes:
        assert self._process.stdout is not None
        return await self._process.stdout.readline()

    async def end(self) -> None:
        assert self._process.stdin is not None
        self._process.stdin.close()
        await self._process.wait()


@pytest.mark.slow
@pytest.mark.timeout(60 + SMALL_KILLS)
async def test_wherever_it_dies_nothing_acknowledged_or_seen_is_lost(tmp_path: Path) -> None:
    mortal = await Mortal.begun(tmp_path)
    points = itertools.cycle((*POINTS, *[NOWHERE] * len(POINTS)))  # half of them at any moment
    acknowledged = 0
    writers: list[Writer] = []
    for kill, point in zip(range(SMALL_KILLS), points, strict=False):
        graph = f"g{kill // _SHARING}"
        if kill % _SHARING == 0:
            acknowledged += sum(writer.acknowledged for writer in writers)
            writers = [Writer(name) for name in "abc"[:WRITERS]]
        await mortal.bear(f"graph/{graph}", point, random.randint(1, 40))
        pipes = [await mortal.connected() for _ in writers]
        work = [writer.write_to(pipe) for writer, pipe in zip(writers, pipes, strict=True)]
        together = asyncio.gather(*work)
        if point == NOWHERE:
            await asyncio.sleep(random.uniform(0, 0.2))
            os.kill(mortal.child, signal.SIGKILL)
        await asyncio.wait_for(together, 30)
        await mortal.dead()
        things = at_rest(tmp_path / "editor.db", graph)
        for writer in writers:
            must = {f"{writer.name}{n}" for n in range(1, writer.acknowledged + 1)}
            assert must <= things, (kill, point)
            assert writer.seen <= things, (kill, point)
    assert acknowledged >= 2 * SMALL_KILLS or SMALL_KILLS < 2 * _SHARING
    await mortal.end()
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    assert await journal.verify() == []
    await journal.close()


def at_rest(database: Path, graph: str) -> set[str]:
    """Return the things in a log that no process has open."""
    doc: Doc[Any] = Doc()
    with contextlib.closing(sqlite3.connect(database)) as connection:
        rows = connection.execute(
            "SELECT seq, body FROM event WHERE stream = ? ORDER BY seq", (f"graph/{graph}",)
        ).fetchall()
    assert [seq for seq, _ in rows] == list(range(1, len(rows) + 1))
    with doc.transaction():
        for _, body in rows:
            doc.apply_update(body)
    return set(doc.get("things", type=Map).keys())
