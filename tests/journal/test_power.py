"""Power cuts, full disks and failing writes under the journal on SQLite."""

import asyncio
import os
import random
import shutil
import sqlite3
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, closing
from pathlib import Path

import apsw
import pytest

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.chain import Inspector
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.sqlite import Sqlite
from journal.crashes import Disk, Driver

IMAGES = int(os.environ.get("SOAK_IMAGES", "1000"))
FAULTS = int(os.environ.get("SOAK_FAULTS", "60"))
_SCAN = "SELECT stream, seq, kind, author, at, body, position, chain FROM event ORDER BY position"


def draft(size: int = 30) -> Draft:
    return Draft("thing.happened.v1", "ada", bytes(size))


@asynccontextmanager
async def recorded(folder: Path, disk: Disk, synchronous: str = "FULL") -> AsyncIterator[Journal]:
    database = Sqlite(folder / "editor.db", driver=Driver(disk, synchronous))
    journal = await Journal.on(database, branch="editor", fold=nothing)
    yield journal
    await journal.close()


async def history(folder: Path, disk: Disk, synchronous: str) -> list[tuple[int, int]]:
    """A busy journal; after which step how many events were acknowledged."""
    acknowledged: list[tuple[int, int]] = []
    chance = random.Random(3)
    async with recorded(folder, disk, synchronous) as journal:
        for n in range(150):
            sizes = [chance.choice((20, 50, 300, 5000)) for _ in range(chance.randint(1, 4))]
            await asyncio.gather(*(journal.append(f"s{n % 3}", [draft(size)]) for size in sizes))
            acknowledged.append((len(disk.steps), await journal.position()))
            if n % 40 == 20:
                await journal.keep_snapshot(f"s{n % 3}", 1, bytes(9000))
    return acknowledged


def after_the_cut(folder: Path, files: dict[str, bytes]) -> int:
    """Start again from what the disk holds; the number of events. Fails when anything is torn."""
    for old in folder.iterdir():
        old.unlink()
    for name, data in files.items():
        if not name.endswith("-shm"):
            (folder / name).write_bytes(data)
    with closing(sqlite3.connect(folder / "editor.db")) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        inspector = Inspector()
        for row in connection.execute(_SCAN):
            inspector.see(row)
        assert inspector.findings(None) == []
        return inspector.seen


async def losses(tmp_path: Path, synchronous: str, images: int) -> int:
    """Return how many of the power cuts lost an acknowledged event."""
    disk = Disk()
    lived, image = tmp_path / "lived", tmp_path / "image"
    lived.mkdir()
    image.mkdir()
    acknowledged = await history(lived, disk, synchronous)
    first = acknowledged[0][0]
    chance = random.Random(5)
    lost = 0
    for _ in range(images):
        until = chance.randint(first, len(disk.steps))
        promised = max(count for steps, count in acknowledged if steps <= until)
        lost += after_the_cut(image, disk.image(until, chance)) < promised
    return lost


async def test_no_power_cut_loses_what_was_acknowledged(tmp_path: Path) -> None:
    assert await losses(tmp_path, "FULL", IMAGES) == 0


async def test_the_check_of_power_cuts_sees_losses_where_there_are_some(tmp_path: Path) -> None:
    assert await losses(tmp_path, "NORMAL", 100) > 10


@pytest.mark.parametrize("kind", ["write", "sync"])
@pytest.mark.parametrize("error", [apsw.FullError, apsw.IOError])
async def test_whichever_write_fails_edits_are_refused_and_go_on_afterwards(
    tmp_path: Path, kind: str, error: type[Exception]
) -> None:
    disk = Disk()
    left = -1

    def fault(what: str) -> None:
        nonlocal left
        if what == kind and left >= 0:
            left -= 1
            if left < 0:
                raise error("the disk fails")

    disk.fault = fault
    stored: list[bytes] = []
    refused = 0
    async with recorded(tmp_path, disk) as journal:
        for n in range(FAULTS):
            left = n % 9
            for each in range(3):
                body = f"{n}/{each}".encode()
                try:
                    await journal.append("a", [Draft("t.v1", "ada", body)], expected=len(stored))
                except Unavailable as refusal:
                    refused += 1
                    assert "the disk fails" in refusal.detail  # noqa: PT017
                    assert [e.body for e in await journal.read("a")][: len(stored)] == stored
                    left = -1
                    stored = [e.body for e in await journal.read("a")]
                    continue
                stored.append(body)
        left = -1
        assert [e.body for e in await journal.read("a")] == stored
        assert len(set(stored)) == len(stored)
        assert await journal.verify() == []
    assert refused > FAULTS // 9
    async with recorded(tmp_path, Disk()) as again:
        assert [e.body for e in await again.read("a")] == stored


async def test_a_full_disk_refuses_edits_until_there_is_room_again(
    small_disk: Callable[[str], Path],
) -> None:
    disk = small_disk("2m")
    ballast = disk / "ballast"
    journal = await Journal.open(f"sqlite:///{disk / 'editor.db'}", branch="editor", fold=nothing)
    await journal.append("a", [draft()])
    ballast.write_bytes(bytes(1_000_000))
    acknowledged = 1
    with pytest.raises(Unavailable, match="full"):  # noqa: PT012
        for _ in range(200):
            await journal.append("a", [draft(20_000)])
            acknowledged += 1
    for _ in range(3):  # it stays so, and reading goes on
        with pytest.raises(Unavailable):
            await journal.append("a", [draft(20_000)])
        assert [e.seq for e in await journal.read("a")] == list(range(1, acknowledged + 1))
    ballast.unlink()
    assert await journal.append("a", [draft(20_000)]) == acknowledged + 1
    assert await journal.verify() == []
    await journal.close()


async def test_a_disk_that_is_full_at_the_start_is_called_full(
    small_disk: Callable[[str], Path],
) -> None:
    disk = small_disk("1m")
    url = f"sqlite:///{disk / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=nothing)
    await journal.append("a", [draft()])
    await journal.close()
    (disk / "ballast").write_bytes(bytes(shutil.disk_usage(disk).free))
    with pytest.raises(CannotStart, match="the disk is full"):
        await Journal.open(url, branch="editor", fold=nothing)
