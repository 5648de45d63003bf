"""Every change of a stored event is found, and where it is."""

import asyncio
import os
import random
import sqlite3
from collections.abc import Awaitable, Callable, Iterator
from contextlib import closing
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.chain import Damage
from action_assistant.journal.events import Draft, Event, nothing
from action_assistant.journal.journal import Journal
from journal.servers import Server

Open = Callable[..., Awaitable[Journal]]
FLIPS = int(os.environ.get("SOAK_FLIPS", "300"))


async def filled(journal: Journal) -> list[Event]:
    """Three streams, ten events each."""
    for n in range(10):
        for name in ("a", "b", "c"):
            await journal.append(name, [Draft("thing.happened.v1", "ada", f"{name}{n}".encode())])
    return await journal.read_all()


async def opened(path: Path) -> Journal:
    return await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)


def tamper(path: Path, sql: str) -> None:
    with closing(sqlite3.connect(path)) as other, other:
        other.execute(sql)


async def test_a_log_that_nobody_touched_is_sound(open_journal: Open) -> None:
    journal = await open_journal()
    assert await journal.verify() == []
    await filled(journal)
    assert await journal.verify() == []
    await journal.close()
    again = await open_journal()
    await again.append("a", [Draft("more.v1", "bob", b"")])
    assert await again.verify() == []


@pytest.mark.parametrize(
    "change",
    [
        "body = x'6236'",
        "body = body || x'00'",
        "body = CAST(body AS TEXT)",
        "kind = 'thing.happened.v2'",
        "author = 'eve'",
        "author = CAST(x'616461ff' AS TEXT)",
        "at = at + 1",
        "position = 1000",
        "chain = zeroblob(16)",
        "seq = 100",
    ],
)
async def test_each_column_of_an_event_counts(tmp_path: Path, change: str) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await filled(journal)
    tamper(path, f"UPDATE event SET {change} WHERE stream = 'b' AND seq = 6")
    (found,) = [each for each in await journal.verify() if each.stream]
    assert (found.stream, found.seq) == ("b", 6)
    await journal.close()


async def test_the_first_damage_of_each_stream_is_told_and_others_are_sound(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await filled(journal)
    tamper(path, "UPDATE event SET author = 'eve' WHERE stream = 'a' AND seq IN (3, 7)")
    tamper(path, "UPDATE event SET body = x'' WHERE stream = 'c' AND seq = 10")
    assert [(each.stream, each.seq) for each in await journal.verify()] == [("a", 3), ("c", 10)]
    await journal.close()


@pytest.mark.parametrize("change", ["stream = NULL", "seq = 'x'", "chain = 10"])
async def test_an_end_that_holds_anything_at_all_is_told(tmp_path: Path, change: str) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await filled(journal)
    for sql in (
        "CREATE TABLE loose AS SELECT * FROM head",  # as a damaged file may be, without constraints
        "DROP TABLE head",
        "ALTER TABLE loose RENAME TO head",
        f"UPDATE head SET {change} WHERE stream = 'b'",
    ):
        tamper(path, sql)
    told = [(each.seq, each.why) for each in await journal.verify() if each.stream]
    assert told[0] == (0, "its end is written down in values of the wrong kind")
    await journal.close()


@pytest.mark.parametrize("seq", [1, 5, 10])
async def test_an_event_that_is_missing_is_told_also_at_the_end(tmp_path: Path, seq: int) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await filled(journal)
    tamper(path, f"DELETE FROM event WHERE stream = 'b' AND seq = {seq}")
    assert ("b", seq) in [(each.stream, each.seq) for each in await journal.verify()]
    await journal.close()


async def test_events_that_changed_places_are_told(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await filled(journal)
    for change in (
        "SET seq = 99 WHERE seq = 4",
        "SET seq = 4 WHERE seq = 5",
        "SET seq = 5 WHERE seq = 99",
    ):
        tamper(path, f"UPDATE event {change} AND stream = 'c'")
    (found,) = await journal.verify()
    assert (found.stream, found.seq) == ("c", 4)
    await journal.close()


async def test_a_database_of_no_known_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    await (await opened(path)).close()
    tamper(path, "DROP TABLE alembic_version")
    tamper(path, "CREATE TABLE alembic_version (version_num VARCHAR(32))")
    tamper(path, "INSERT INTO alembic_version VALUES (NULL)")
    with pytest.raises(CannotStart):
        await opened(path)


async def test_a_change_is_found_on_postgres_too(postgres: Server) -> None:
    url = postgres.new_database()
    journal = await Journal.open(url, branch="editor", fold=nothing)
    await filled(journal)
    change = "UPDATE event SET body = 'b5x' WHERE stream = 'b' AND seq = 6"
    await asyncio.to_thread(postgres.sql, change, url.rpartition("/")[2])
    assert await journal.verify() == [Damage("b", 6, "it is not what was written")]
    await journal.close()


@pytest.mark.turns
async def test_each_flipped_byte_of_the_file_is_found_or_changes_no_event(
    tmp_path: Path, in_memory: Path
) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    events = await filled(journal)
    await journal.close()
    whole = path.read_bytes()
    chance = random.Random(17)
    bodies = [whole.index(each.body) for each in events]
    inside = [chance.choice(bodies) + chance.randint(-20, 17) for _ in range(FLIPS)]
    anywhere = chance.sample(range(len(whole)), min(FLIPS // 4, len(whole)))
    copy = in_memory / "copy.db"
    seen = 0
    for at in inside + anywhere:
        bit = 1 << chance.randrange(8)
        flip(copy, whole, at, bit)
        told = await tells(copy)
        assert told or await holds(copy, events), f"byte {at}, bit {bit}"
        seen += told
    assert seen >= len(inside) * 0.9


def flip(copy: Path, whole: bytes, at: int, bit: int) -> None:
    """Write a file that differs from `whole` in one bit."""
    copy.write_bytes(whole[:at] + bytes([whole[at] ^ bit]) + whole[at + 1 :])


@pytest.fixture
def in_memory(tmp_path: Path) -> Iterator[Path]:
    """A folder that waits for no disk, where there is one: copies to look at need none."""
    memory = Path("/dev/shm")
    with TemporaryDirectory(dir=memory if memory.is_dir() else tmp_path) as folder:
        yield Path(folder)


async def tells(path: Path) -> bool:
    """Return whether a file is refused or found damaged."""
    try:
        journal = await opened(path)
    except CannotStart:
        return True
    try:
        return await journal.verify() != []
    finally:
        await journal.close()


async def holds(path: Path, events: list[Event]) -> bool:
    """Return whether a file has all events unchanged, read at once and stream by stream."""
    journal = await opened(path)
    try:
        by_stream = [await journal.read(name) for name in ("a", "b", "c")]
        return await journal.read_all() == events and by_stream == [
            [each for each in events if each.stream == name] for name in ("a", "b", "c")
        ]
    except Unavailable:
        return False
    finally:
        await journal.close()
