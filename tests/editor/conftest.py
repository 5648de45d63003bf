"""A real journal and rooms on it."""

from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from action_assistant.editor.rooms import Rooms
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal


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
    rooms = Rooms(journal, linger=60)
    yield rooms
    await rooms.close()
