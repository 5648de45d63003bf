"""Properties of the journal on SQLite alone."""

import asyncio
import contextlib
import os
import shutil
import sqlite3
import threading
from collections import Counter
from pathlib import Path

import pytest

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal import sqlite
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.sqlite import Sqlite
from journal.crashes import Disk, Driver
from support.waiting import wait_until

DRAFT = Draft("thing.happened.v1", "ada", b"x")


async def opened(path: Path) -> Journal:
    return await Journal.open(f"sqlite:///{path}", branch="editor", fold=nothing)


async def test_every_commit_reaches_the_disk(tmp_path: Path) -> None:
    journal = await opened(tmp_path / "editor.db")
    found: dict[str, object] = {}

    def ask(transaction: object) -> None:
        for name in ("journal_mode", "synchronous", "foreign_keys"):
            found[name] = transaction.connection.exec_driver_sql(f"PRAGMA {name}").scalar()  # type: ignore[attr-defined]

    await journal._write(ask)
    await journal.close()
    assert found == {"journal_mode": "wal", "synchronous": 2, "foreign_keys": 1}


async def test_a_snapshot_that_was_tampered_with_is_not_used(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await journal.append("a", [DRAFT, DRAFT])
    await journal.keep_snapshot("a", 2, b"state")
    for change in ("state = x'00'", "seq = 1, state = x'73746174'", "seq = 9"):
        with sqlite3.connect(path) as other:
            other.execute(f"UPDATE snapshot SET {change}")
        other.close()
        assert await journal.snapshot("a") is None
    await journal.close()


async def test_a_journal_that_cannot_write_says_so_and_recovers_by_itself(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await journal.append("a", [DRAFT])
    await journal._write(
        lambda transaction: transaction.connection.exec_driver_sql("PRAGMA max_page_count=1")
    )
    with pytest.raises(Unavailable, match="full"):
        await journal.append("a", [Draft("big.v1", "ada", bytes(1_000_000))])
    assert [e.seq for e in await journal.read("a")] == [1]
    assert await journal.append("a", [DRAFT]) == 2  # on a new connection, without that limit
    await journal.close()


async def test_a_folder_that_cannot_be_written_is_one_clear_sentence(tmp_path: Path) -> None:
    if os.geteuid() == 0:
        target = tmp_path / "file"
        target.write_text("")  # root may write anywhere, but not below a file
    else:
        target = tmp_path / "locked"
        target.mkdir(mode=0o500)
    with pytest.raises(CannotStart, match="Cannot write to the folder"):
        await opened(target / "data" / "editor.db")


async def test_a_file_that_is_no_database_is_one_clear_sentence(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    path.write_bytes(b"this is a letter" * 100)
    with pytest.raises(CannotStart, match="not a database"):
        await opened(path)


async def test_a_failed_opening_lets_go_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "editor.db"
    path.write_bytes(b"this is a letter" * 100)
    with pytest.raises(CannotStart):
        await opened(path)
    path.unlink()
    journal = await opened(path)
    await journal.close()


@pytest.mark.parametrize("url", ["mysql://there/db", "nonsense", "sqlite://"])
async def test_a_database_that_we_do_not_know_is_refused(url: str) -> None:
    with pytest.raises(CannotStart, match=r"[Dd]atabase"):
        await Journal.open(url, branch="editor", fold=nothing)


async def test_a_closed_journal_is_one_file(tmp_path: Path) -> None:
    journal = await opened(tmp_path / "editor.db")
    await journal.append("a", [DRAFT])
    await journal.close()
    shutil.copy(tmp_path / "editor.db", tmp_path / "copy.db")
    copy = await opened(tmp_path / "copy.db")
    assert await copy.newest("a") == 1
    await copy.close()


class _FileWrites(Disk):
    """A disk that notes which threads write to the database file itself, beside its log."""

    def __init__(self) -> None:
        super().__init__()
        self.by: Counter[str] = Counter()
        self.log_size = 0

    def note(self, what: str, file: str, offset: int = 0, data: bytes = b"") -> None:
        if file.endswith("-wal"):
            self.log_size = max(self.log_size, offset + len(data))
        elif what in {"write", "sync"}:
            self.by[threading.current_thread().name] += 1


async def test_no_commit_copies_the_log_into_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sqlite, "_SOONEST_S", 0.01)
    monkeypatch.setattr(sqlite, "_LATEST_S", 0.01)
    disk = _FileWrites()
    path = tmp_path / "editor.db"
    journal = await Journal.on(Sqlite(path, driver=Driver(disk)), branch="editor", fold=nothing)
    body, copies = bytes(5_000_000), "editor.db checkpoints"
    disk.by.clear()
    for n in range(1, 5):  # SQLite would copy its log after each of them
        await journal.append("a", [Draft("big.v1", "ada", body)])
        await journal.derive(lambda connection: connection.exec_driver_sql("SELECT 1"))
        await wait_until(lambda: path.stat().st_size > n * len(body))  # noqa: B023
    assert set(disk.by) == {copies}
    assert disk.log_size < 15_000_000  # it begins anew when all of it was copied
    await journal.close()


async def test_the_log_that_a_long_reader_keeps_is_copied_once_it_has_gone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sqlite, "_SOONEST_S", 0.01)
    monkeypatch.setattr(sqlite, "_LATEST_S", 0.01)
    path = tmp_path / "editor.db"
    journal = await opened(path)
    await journal.append("a", [DRAFT])
    reader = sqlite3.connect(path, isolation_level=None)
    reader.execute("BEGIN")
    assert reader.execute("SELECT count(*) FROM event").fetchone() == (1,)
    for _ in range(10):
        await journal.append("a", [Draft("big.v1", "ada", bytes(100_000))])
    await asyncio.sleep(0.1)
    assert path.stat().st_size < 1_000_000
    reader.execute("ROLLBACK")
    reader.close()
    await journal.append("a", [DRAFT])
    await wait_until(lambda: path.stat().st_size > 1_000_000)
    await journal.close()


def test_a_close_in_the_moment_of_a_checkpoint_does_not_wait_for_ever(tmp_path: Path) -> None:
    class ClosedWhenCleared(threading.Event):
        def clear(self) -> None:
            checkpoints._closed.set()
            self.set()  # as `close` does, right before the thread clears it
            super().clear()

    with contextlib.closing(sqlite3.connect(tmp_path / "log.db")) as database:
        database.execute("PRAGMA journal_mode=WAL")
        checkpoints = sqlite.Checkpoints(tmp_path / "log.db", sqlite3)
        checkpoints._due = ClosedWhenCleared()
        checkpoints.committed()
        assert checkpoints._thread is not None
        checkpoints._thread.join(20)
        assert not checkpoints._thread.is_alive()
