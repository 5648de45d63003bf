"""A graph that an owner hides while somebody connects to its room: whoever may not see it any more stays out."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.rooms.room import Room
from action_assistant.web.auth.keys import Keys
from action_assistant.web.auth.roles import Role
from editor.in_process import URL, Socket, browser, editor_here
from editor.process import BEARER
from support.product import TOKEN

# The application is made within a loop here.
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

HIDDEN = {"rule": {"readers": [], "editors": []}}


@pytest.fixture
async def app(tmp_path: Path) -> AsyncIterator[Any]:
    """An editor in this process."""
    async with editor_here(tmp_path) as here:
        yield here.app


@pytest.fixture
async def owner(app: Any) -> AsyncIterator[httpx.AsyncClient]:
    """A program with the owner's token."""
    async with browser(app, headers=BEARER) as owner:
        yield owner


async def headers_of(app: Any, owner: httpx.AsyncClient, role: Role, who: str) -> dict[str, str]:
    """Return the headers of a new person's browser, or of their program with a token to read."""
    made = await owner.post("/api/members", json={"name": who, "role": role, "groups": []})
    session = Keys(TOKEN).new_session(who, role=role, person_id=made.json()["id"], personal=True)
    person = {"cookie": f"aa_8000={Keys(TOKEN).sealed(session)}", "origin": URL}
    if who != "program":
        return person
    async with browser(app, headers=person) as page:
        body = {"name": "script", "scopes": ["read"], "days": 1}
        token = (await page.post("/api/tokens", json=body)).json()["token"]
    return {"authorization": f"Bearer {token}"}


@pytest.mark.parametrize(
    ("role", "who"), [("viewer", "viewer"), ("editor", "program"), ("editor", "editor")]
)
async def test_whoever_connects_while_the_graph_is_hidden_stays_out_of_its_room(
    app: Any, owner: httpx.AsyncClient, monkeypatch: pytest.MonkeyPatch, role: Role, who: str
) -> None:
    graph = (await owner.post("/api/graphs", json={"name": "Secret"})).json()["id"]
    headers = await headers_of(app, owner, role, who)
    is_loading, is_hidden = asyncio.Event(), asyncio.Event()
    load = Rooms._load

    async def slow(rooms: Rooms, stream: str) -> Room:
        is_loading.set()
        await is_hidden.wait()
        return await load(rooms, stream)

    monkeypatch.setattr(Rooms, "_load", slow)
    socket = Socket(app, f"/api/graphs/{graph}/room", headers)
    try:
        async with asyncio.timeout(20):
            await is_loading.wait()
        (await owner.put(f"/api/graphs/{graph}/rule", json=HIDDEN)).raise_for_status()
        is_hidden.set()
        assert await socket.close_code(5) == 1012  # it comes back, and is refused
    finally:
        await socket.end()
    again = Socket(app, f"/api/graphs/{graph}/room", headers)
    assert await again.close_code() == 404
    await again.end()
