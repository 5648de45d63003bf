"""The real editor as a process of its own, that tests may kill."""

import contextlib
import os
import signal
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from typing import Any

import httpx
import httpx_ws
from pycrdt import Doc, Provider
from pycrdt.websocket.websocket import HttpxWebsocket

from support import warm
from support.product import TOKEN, free_ports

BEARER = {"authorization": f"Bearer {TOKEN}"}


class Editor:
    """An editor on a free port. `kill` and `start` may be called in turn."""

    def __init__(self, data: Path, database: str | None = None, *flags: str) -> None:
        self.data = data
        self._flags = [*(["--database", database] if database else []), *flags]
        self.port = free_ports()
        self.log = data.parent / f"{data.name}.log"
        self._process: warm.Process | None = None

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self.port}"

    @property
    def process(self) -> warm.Process:
        """Its process, which has begun."""
        assert self._process is not None
        return self._process

    @property
    def words(self) -> list[str]:
        """The words after the name of the program."""
        return ["editor", "--data", str(self.data), "--port", str(self.port), *self._flags]

    def start(self) -> None:
        """Start it and wait until it answers."""
        self.begin()
        self.wait()

    def begin(self, **environ: str) -> None:
        """Start it. `environ`: further variables of its environment."""
        given = {**os.environ, "ACTION_ASSISTANT_TOKEN": TOKEN, **environ}
        self._process = warm.start(self.words, given, self.log)

    def wait(self) -> None:
        """Wait until it answers."""
        deadline = time.monotonic() + 120
        while True:
            with contextlib.suppress(httpx.TransportError):
                if httpx.get(f"{self.url}/readyz", trust_env=False).status_code == 200:
                    return
            if time.monotonic() > deadline or self.process.poll() is not None:
                raise AssertionError(f"not ready:\n{self.log.read_text()[-4000:]}")
            time.sleep(0.05)

    def kill(self) -> None:
        """kill -9, whatever it is doing. Do nothing if it does not run."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def end(self) -> int:
        """Ask it to end; the exit code."""
        if self._process is None:
            return 0
        self._process.terminate()
        code = self._process.wait(30)
        self._process = None
        return code

    def client(self) -> httpx.Client:
        """Return an HTTP client with the token."""
        return httpx.Client(base_url=self.url, headers=BEARER, trust_env=False, timeout=60)

    def room(self, graph: str, query: str = "") -> str:
        """The address of a graph's room."""
        return f"ws://127.0.0.1:{self.port}/api/graphs/{graph}/room{query}"

    @contextlib.asynccontextmanager
    async def socket(
        self, graph: str, query: str = "", **headers: str
    ) -> AsyncIterator[httpx_ws.AsyncWebSocketSession]:
        """A plain socket into a room."""
        async with (
            httpx.AsyncClient(trust_env=False) as client,
            httpx_ws.aconnect_ws(
                self.room(graph, query), client, headers={**(headers or BEARER)}
            ) as session,
        ):
            yield session

    @contextlib.asynccontextmanager
    async def joined(self, graph: str, doc: Doc[Any]) -> AsyncIterator[Provider]:
        """A stock pycrdt client in a room, in sync."""
        async with (
            self.socket(graph) as session,
            Provider(doc, HttpxWebsocket(session, graph)) as provider,
        ):
            await provider.synced.wait()
            yield provider


@contextlib.contextmanager
def running(data: Path, database: str | None = None) -> Iterator[Editor]:
    """An editor that runs inside the block."""
    editor = Editor(data, database)
    editor.start()
    try:
        yield editor
    finally:
        code = editor.end()
        if code not in {0, -signal.SIGTERM}:
            raise AssertionError(f"exit code {code}:\n{editor.log.read_text()[-4000:]}")
