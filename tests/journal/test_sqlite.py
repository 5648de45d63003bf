"""What is special about the journal on SQLite."""

import os
import shutil
import sqlite3
from pathlib import Path

import pytest

from action_assistant.errors import CannotStart, Unavailable
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal

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
