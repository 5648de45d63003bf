"""A real journal and rooms on it."""

from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import httpx
import pytest

from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from editor.process import Editor, running


@pytest.fixture
async def journal(tmp_path: Path) -> AsyncIterator[Journal]:
    """A journal on SQLite."""
    journal = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    yield journal
    await journal.close()


@pytest.fixture
async def rooms(journal: Journal) -> AsyncIterator[Rooms]:
    """Rooms that stay open until the test ends."""
    rooms = Rooms(journal, linger=60, window=0)
    yield rooms
    await rooms.close()


@pytest.fixture(scope="session")
def editor(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Editor]:
    """A running editor that tests share; each makes its own graphs."""
    with running(tmp_path_factory.mktemp("editor") / "data") as editor:
        yield editor


@pytest.fixture
def http(editor: Editor) -> Iterator[httpx.Client]:
    """A program with the token."""
    with editor.client() as client:
        yield client


@pytest.fixture
def graph(http: httpx.Client) -> str:
    """The id of an empty graph."""
    made: str = http.post("/api/graphs", json={"name": "task"}).json()["id"]
    return made
