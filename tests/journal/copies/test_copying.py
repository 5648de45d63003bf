"""A journal is copied event for event, from either database into either, also while it is written."""

import asyncio
import os
import random
import tracemalloc
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import select, text

from action_assistant.editor.log import graph_events as h
from action_assistant.errors import CannotStart
from action_assistant.journal.copies.copying import copy
from action_assistant.journal.databases import database_of
from action_assistant.journal.events import Addition, Event
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from journal.servers import Server
from journal.whole_log import whole_log


@pytest.fixture(params=["from SQLite", "from Postgres"])
def ways(request: pytest.FixtureRequest, tmp_path: Path, postgres: Server) -> tuple[str, str]:
    """Return the source and the target of a copy."""
    file = f"sqlite:///{tmp_path / 'one.db'}"
    server = postgres.new_database()
    return (file, server) if request.param == "from SQLite" else (server, file)


async def opened(url: str) -> Journal:
    return await Journal.open(url, branch="editor", fold=h.fold)


async def filled(url: str, events: int = 300) -> None:
    """Graphs of several people, with names that need care."""
    journal = await opened(url)
    dice = random.Random(7)
    for number in range(events // 3):
        graph, name = f"g{number % 20}", f"Zoë {number} 🤖\x01'\""
        made = h.draft(h.CREATED, "ann", h.GraphCreated(name, "what it does"))
        additions = [
            Addition(h.PEOPLE, (h.draft(h.NAMED, f"p{number % 7}", h.PersonNamed(name)),)),
            Addition(
                h.graph_stream(graph), (h.Draft(h.UPDATED, "ben", dice.randbytes(number * 20)),)
            ),
        ]
        if number < 20:
            additions.insert(0, Addition(h.about_stream(graph), (made,)))
        await journal.append_all(additions)
    await journal.keep_snapshot("graph/g1", 1, b"\0state")
    await journal.close()


async def everything(url: str) -> tuple[list[Event], dict[str, list[Any]]]:
    """Return all events and all rows of all tables; the journal has to be sound."""
    journal = await opened(url)
    try:
        assert await journal.verify() == []
        events = await whole_log(journal)
        rows = {
            name: sorted(map(tuple, await journal.query(select(table))), key=repr)
            for name, table in editor_tables.EDITOR.tables.items()
        }
        return events, rows
    finally:
        await journal.close()


def copied(source: str, target: str, **more: Any) -> int:
    return copy(database_of(source), database_of(target), branch="editor", fold=h.fold, **more)


async def test_a_copy_has_every_event_and_every_row(ways: tuple[str, str]) -> None:
    source, target = ways
    await filled(source)
    told: list[int] = []
    events = await asyncio.to_thread(copied, source, target, tell=told.append)
    before, after = await everything(source), await everything(target)
    assert len(before[0]) == events == told[-1]
    assert len(told) > 3
    assert before[0] == after[0]
    for tables in (before[1], after[1]):
        del tables["written_by"]  # each says for itself who has written to it
    assert before[1] == after[1]


async def test_each_concurrent_transaction_is_in_the_copy_wholly_or_not_at_all(
    ways: tuple[str, str],
) -> None:
    source, target = ways
    await filled(source)
    journal = await opened(source)
    started = await journal.position()

    async def write() -> None:
        for number in range(10_000):
            names = [h.draft(h.NAMED, f"w{number}", h.PersonNamed(str(number)))] * 3
            await journal.append(h.PEOPLE, names)

    writing = asyncio.create_task(write())
    await asyncio.sleep(0.05)
    count = await asyncio.to_thread(copied, source, target)
    writing.cancel()
    await asyncio.wait([writing])
    whole = await whole_log(journal)
    await journal.close()
    events, _ = await everything(target)
    assert len(whole) > len(events)
    assert events == whole[:count]
    assert (len(events) - started) % 3 == 0


async def test_a_target_that_holds_something_is_left_alone(ways: tuple[str, str]) -> None:
    source, target = ways
    await filled(source, 9)
    await filled(target, 30)
    before = await everything(target)
    with pytest.raises(CannotStart, match="holds events already"):
        await asyncio.to_thread(copied, source, target)
    assert await everything(target) == before


@pytest.mark.parametrize(
    "harm",
    [
        "UPDATE event SET author = 'eve' WHERE position = 100",
        "DELETE FROM event WHERE position = 100",
        "DELETE FROM event WHERE position = (SELECT max(position) FROM event)",
    ],
)
async def test_a_damaged_journal_is_not_copied(ways: tuple[str, str], harm: str) -> None:
    source, target = ways
    await filled(source)
    await asyncio.to_thread(database_of(source).migrate, lambda c: c.execute(text(harm)))
    with pytest.raises(CannotStart, match=r"The journal is damaged: .*event [0-9]+"):
        await asyncio.to_thread(copied, source, target)
    assert (await everything(target))[0] == []


async def test_an_older_journal_is_copied_without_being_changed(ways: tuple[str, str]) -> None:
    from action_assistant.journal.databases import migrate

    source, target = ways
    await asyncio.to_thread(migrate, source, "editor", "editor_0001")
    assert await asyncio.to_thread(copied, source, target) == 0
    revision = select(text("version_num")).select_from(text("alembic_version"))
    database = database_of(source)
    assert await database.ask(lambda c: c.execute(revision).scalar()) == "editor_0001"
    await database.close()


async def test_memory_does_not_grow_with_the_journal(ways: tuple[str, str]) -> None:
    source, target = ways
    journal = await opened(source)
    for _ in range(16):
        await journal.append("graph/g", [h.Draft(h.UPDATED, "ann", os.urandom(40_000))] * 25)
    await journal.close()
    tracemalloc.start()
    await asyncio.to_thread(copied, source, target)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 12_000_000  # of 16 MB
