"""A database that is not ours, or a newer one, is told apart and left exactly as it is."""

import asyncio
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import Connection, text

from action_assistant.errors import CannotStart
from action_assistant.journal.databases import database_of, migrate
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from journal.servers import Server


def _sql(*commands: str) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        with closing(sqlite3.connect(path)) as database, database:
            for command in commands:
                database.execute(command)

    return make


def _in_wal(path: Path) -> None:
    """A program that writes just now: what it wrote stands beside the file."""
    database = sqlite3.connect(path)
    database.execute("PRAGMA journal_mode=WAL")
    database.execute("CREATE TABLE moz_places (id INTEGER)")
    database.commit()
    copy = {each: each.read_bytes() for each in path.parent.iterdir() if each.name != "x.db-shm"}
    database.close()
    for each, content in copy.items():
        each.write_bytes(content)


def _interrupted(path: Path) -> None:
    """A program whose power was cut: its next reader takes back what it had begun."""
    with closing(sqlite3.connect(path, isolation_level=None)) as database:
        database.execute("CREATE TABLE moz_places (text TEXT)")
        database.executemany("INSERT INTO moz_places VALUES (?)", [("x" * 3000,)] * 200)
        database.execute("PRAGMA cache_size=1")
        database.execute("BEGIN")
        database.execute("UPDATE moz_places SET text = 'y' || text")
        copy = {each: each.read_bytes() for each in path.parent.iterdir()}
    for each, content in copy.items():
        each.write_bytes(content)
    assert path.with_name("x.db-journal").stat().st_size > 512


def _ours(path: Path) -> None:
    migrate(f"sqlite:///{path}", "editor")


def _ours_and(*commands: str) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        _ours(path)
        _sql(*commands)(path)

    return make


FOREIGN = {
    "another program's tables": (
        _sql("CREATE TABLE moz_places (id INTEGER)", "INSERT INTO moz_places VALUES (1)"),
        "is another program's",
    ),
    "another program's, written just now": (_in_wal, "is another program's"),
    "another program's, interrupted": (_interrupted, "is another program's"),
    "another program's that has a table event": (
        _sql("CREATE TABLE event (id INTEGER, what TEXT)"),
        "is another program's",
    ),
    "another program's that uses Alembic, too": (
        _sql(
            "CREATE TABLE alembic_version (version_num TEXT)",
            "INSERT INTO alembic_version VALUES ('1975ea83b712')",
        ),
        "is another program's",
    ),
    "another program's mark": (
        _sql("CREATE TABLE a (b)", "PRAGMA application_id = 252006675"),
        "is another program's",
    ),
    "a name of ours on another's tables": (
        _sql(
            "CREATE TABLE alembic_version (version_num TEXT)",
            "INSERT INTO alembic_version VALUES ('editor_0001')",
        ),
        "is another program's",
    ),
    "no database": (lambda path: path.write_bytes(b"not a database" * 99), "is not a database"),
    "the end of a database": (
        lambda path: path.write_bytes(b"SQLite format 3\0" + bytes(40)),
        "is not a database",
    ),
    "a newer version": (
        _ours_and("UPDATE alembic_version SET version_num = 'editor_9999'"),
        "made by a newer version .*editor_9999",
    ),
    "the runner's": (lambda path: migrate(f"sqlite:///{path}", "runner"), "is not the editor's"),
}


def _opened(path: Path) -> None:
    asyncio.run(Journal.open(f"sqlite:///{path}", branch="editor", fold=lambda _: ()))


def _prepared(path: Path) -> None:
    Journal.prepare(f"sqlite:///{path}", "editor")


def _migrated(path: Path) -> None:
    migrate(f"sqlite:///{path}", "editor")


@pytest.mark.turns
@pytest.mark.parametrize("step", [_opened, _prepared, _migrated])
@pytest.mark.parametrize("kind", FOREIGN)
def test_a_foreign_database_is_refused_and_left_as_it_is(
    tmp_path: Path, kind: str, step: Callable[[Path], None]
) -> None:
    make, why = FOREIGN[kind]
    path = tmp_path / "x.db"
    make(path)
    before = _folder(tmp_path)
    with pytest.raises(CannotStart, match=why) as refused:
        step(path)
    assert str(path) in str(refused.value)
    assert _folder(tmp_path) == before


def _folder(folder: Path) -> dict[str, bytes]:
    """Every file but the index of a log, which whoever reads one makes."""
    return {
        each.name: each.read_bytes()
        for each in folder.iterdir()
        if not each.name.endswith(("-shm", ".lock"))
    }


def test_an_empty_file_becomes_ours_and_an_old_one_of_ours_is_taken_on(tmp_path: Path) -> None:
    (tmp_path / "empty.db").touch()
    _opened(tmp_path / "empty.db")
    migrate(f"sqlite:///{tmp_path / 'old.db'}", "editor", "editor_0001")
    _opened(tmp_path / "old.db")


async def test_a_file_whose_every_table_is_still_in_its_log_is_ours(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'one.db'}"
    journal = await Journal.open(url, branch="editor", fold=lambda _: ())
    await journal.append("people", [Draft("a.b.v1", "ada", b"{}")])
    copy = tmp_path / "copy"
    copy.mkdir()
    for name in ("one.db", "one.db-wal"):  # as a crash leaves them
        (copy / name).write_bytes((tmp_path / name).read_bytes())
    await journal.close()
    other = await Journal.open(f"sqlite:///{copy / 'one.db'}", branch="editor", fold=lambda _: ())
    assert await other.position() == 1
    await other.close()


def test_a_postgres_database_of_another_program_is_refused(postgres: Server) -> None:
    url = postgres.new_database()

    def theirs(connection: Connection) -> None:
        connection.execute(text("CREATE TABLE graph (id INTEGER)"))

    def tables(connection: Connection) -> int:
        counted = "SELECT count(*) FROM information_schema.tables WHERE table_schema = 'public'"
        found: int = connection.execute(text(counted)).scalar_one()
        return found

    database_of(url).migrate(theirs)
    with pytest.raises(CannotStart, match="is another program's"):
        migrate(url, "editor")
    assert database_of(url).migrate(tables) == 1
