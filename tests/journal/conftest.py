"""Journals to test: every kind that there is."""

from collections.abc import AsyncIterator, Awaitable, Callable
from pathlib import Path

import pytest

from action_assistant.journal.events import Fold, nothing
from action_assistant.journal.journal import Journal
from journal.servers import Server

Open = Callable[..., Awaitable[Journal]]


@pytest.fixture(params=["sqlite", "postgres"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A database of each kind, empty."""
    match request.param:
        case "sqlite":
            return f"sqlite:///{tmp_path / 'editor.db'}"
        case "postgres":
            server: Server = request.getfixturevalue("postgres")
            return server.new_database()
        case other:
            raise AssertionError(other)


@pytest.fixture
async def open_journal(url: str) -> AsyncIterator[Open]:
    """Opens the same journal as often as asked; closes them all."""
    opened: list[Journal] = []

    async def opening(fold: Fold = nothing) -> Journal:
        journal = await Journal.open(url, branch="editor", fold=fold)
        opened.append(journal)
        return journal

    yield opening
    for journal in opened:
        await journal.close()


@pytest.fixture
async def journal(open_journal: Open) -> Journal:
    """A journal without tables."""
    return await open_journal()
