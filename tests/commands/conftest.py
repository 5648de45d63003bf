"""A data folder for tests of commands."""

import asyncio
from pathlib import Path

import pytest

from action_assistant.editor.log import graph_events as h
from action_assistant.journal.journal import Journal


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with an editor's journal of three events."""

    async def fill() -> None:
        url = f"sqlite:///{tmp_path / 'editor.db'}"
        journal = await Journal.open(url, branch="editor", fold=h.fold)
        for name in ("Ada", "Ada L.", "Ada Lovelace"):
            await journal.append(h.PEOPLE, [h.draft(h.NAMED, "ada", h.PersonNamed(name))])
        await journal.close()

    asyncio.run(fill())
    return tmp_path
