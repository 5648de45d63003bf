"""The real editor in the process of a test, which can hold one of its steps until another is done."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final, NamedTuple

import httpx
import pytest

from action_assistant.editor.app import create_app
from action_assistant.editor.services import EditorServices, EditorState
from action_assistant.settings import EditorSettings
from support.product import TOKEN

URL: Final = "http://127.0.0.1:8000"


@asynccontextmanager
async def lifespan(app: Any) -> AsyncIterator[None]:
    """Start and end an application as its server does."""
    heard: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    said: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
    scope = {"type": "lifespan", "asgi": {"version": "3.0"}, "state": {}}
    running = asyncio.create_task(app(scope, heard.get, said.put))
    await heard.put({"type": "lifespan.startup"})
    assert (await said.get())["type"] == "lifespan.startup.complete"
    try:
        yield
    finally:
        await heard.put({"type": "lifespan.shutdown"})
        await said.get()
        await running


def browser(app: Any, **options: Any) -> httpx.AsyncClient:
    """Return a client of an editor that listens on `URL`, as far as it knows."""
    transport = httpx.ASGITransport(app=app, client=("127.0.0.1", 5000))
    return httpx.AsyncClient(transport=transport, base_url=URL, timeout=60, **options)


class Socket:
    """A WebSocket that an editor in this process serves, until it closes it."""

    def __init__(self, app: Any, path: str, headers: dict[str, str]) -> None:
        self._to_app: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        self._from_app: asyncio.Queue[dict[str, Any]] = asyncio.Queue()
        sent = {"host": URL.removeprefix("http://"), **headers}
        scope = {
            "type": "websocket",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "scheme": "ws",
            "path": path,
            "raw_path": path.encode(),
            "root_path": "",
            "query_string": b"",
            "headers": [(name.encode(), value.encode()) for name, value in sent.items()],
            "client": ("127.0.0.1", 5000),
            "server": ("127.0.0.1", 8000),
            "subprotocols": [],
            "state": {},
            "extensions": {"websocket.http.response": {}},
        }
        self._to_app.put_nowait({"type": "websocket.connect"})
        self._served = asyncio.ensure_future(app(scope, self._to_app.get, self._from_app.put))

    async def close_code(self, seconds: float = 20) -> int | None:
        """Return the code with which the editor closes the socket, the status with which it refuses
        it, or None if it does neither for so long."""
        try:
            async with asyncio.timeout(seconds):
                while True:
                    said = await self._from_app.get()
                    if said["type"] == "websocket.close":
                        return int(said["code"])
                    if said["type"] == "websocket.http.response.start":
                        return int(said["status"])
        except TimeoutError:
            return None

    async def end(self) -> None:
        """Leave, and wait until the editor has noticed."""
        self._to_app.put_nowait({"type": "websocket.disconnect", "code": 1000})
        await self._served


class EditorHere(NamedTuple):
    """A running editor: the application that its server would serve, and what stands behind it."""

    app: Any
    services: EditorServices


@asynccontextmanager
async def editor_here(data: Path) -> AsyncIterator[EditorHere]:
    """Run an editor whose token is that of tests."""
    found: list[EditorServices] = []
    opened = EditorState.open

    def opens(state: EditorState, services: EditorServices) -> None:
        found.append(services)
        opened(state, services)

    database = f"sqlite:///{data / 'editor.db'}"
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ACTION_ASSISTANT_TOKEN", TOKEN)
        patch.setattr(EditorState, "open", opens)
        app = create_app(EditorSettings(data=data, database=database, port=8000, limits=False))
        async with lifespan(app):
            yield EditorHere(app, found[0])
