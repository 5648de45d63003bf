"""A journal that is really broken says that it cannot store, and why."""

import asyncio
import resource
import threading
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from prometheus_client import CollectorRegistry
from sqlalchemy import update

from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.schema.branches import VERSIONS

FINE = {"database": None, "writer": None, "schema": None}


@pytest.fixture
async def journal(tmp_path: Path) -> AsyncIterator[Journal]:
    """An empty one in a file."""
    url = f"sqlite:///{tmp_path / 'journal.db'}"
    opened = await Journal.open(url, branch="editor", fold=nothing)
    yield opened
    await opened.close()


def draft(size: int) -> Draft:
    return Draft("thing.happened.v1", "ada", b"x" * size)


async def test_a_journal_that_works_says_so_and_leaves_no_trace(journal: Journal) -> None:
    await journal.append("thing/1", [draft(1)])
    assert await journal.parts() == FINE
    assert await journal.snapshot("health") is None
    assert await journal.position() == 1


async def test_a_full_disk_is_noticed_and_so_is_room_on_it(journal: Journal) -> None:
    await journal.append("thing/1", [draft(1)])
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, hard))  # bytes of any file
    try:
        parts = await journal.parts()
        failing = journal.metrics.failing
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
    assert parts["database"] is not None
    assert "Nothing can be stored" in parts["database"]
    assert failing
    await journal.append("thing/1", [draft(1)])
    assert journal.metrics.failing is None
    await asyncio.sleep(1.1)  # what was found is good for a second
    assert await journal.parts() == FINE


async def test_a_writer_that_hangs_is_told_from_a_database_that_does(journal: Journal) -> None:
    free = threading.Event()
    await journal.append("thing/1", [draft(1)])
    held = journal.derive(lambda _: free.wait(30))
    waiting = asyncio.ensure_future(held)
    await asyncio.sleep(0.05)
    try:
        parts = await journal.parts()
        assert journal.metrics.busy_s > 1
        assert journal.metrics.waiting == 2
    finally:
        free.set()
        await waiting
    assert parts["writer"] is not None
    assert parts["database"] is None


async def test_tables_of_another_version_are_noticed(journal: Journal) -> None:
    other = update(VERSIONS).values(version_num="editor_0999")
    await journal.derive(lambda connection: connection.execute(other))
    parts = await journal.parts()
    assert parts["schema"] is not None
    assert "editor_0999" in parts["schema"]


async def test_commits_are_counted_once_each_and_refusals_are_not(journal: Journal) -> None:
    registry = CollectorRegistry()
    registry.register(journal.metrics)
    before = registry.get_sample_value("action_assistant_commit_seconds_count") or 0
    await journal.append("thing/1", [draft(1), draft(1)])
    for _ in range(2):
        with pytest.raises(Exception, match="was expected"):
            await journal.append("thing/1", [draft(1)], expected=7)
    assert registry.get_sample_value("action_assistant_commit_seconds_count") == before + 1
    assert registry.get_sample_value("action_assistant_events_stored_total") == 2
    assert registry.get_sample_value("action_assistant_writer_waiting") == 0
    assert registry.get_sample_value("action_assistant_commit_failures_total") == 0
