"""Foreign parts of a database's schema are dropped or refused, and named."""

import hashlib
import itertools
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Final

import pytest

from action_assistant.cli import main
from action_assistant.journal import foreign_schema
from action_assistant.journal.database import Branch
from commands.backups.test_restore import changed, filled, here

#: Statements that leave something which can be dropped, and what is said of it.
DROPPED: Final = {
    "CREATE TRIGGER t AFTER INSERT ON event BEGIN DELETE FROM event; END": "the trigger 't' on 'event'",
    "CREATE TRIGGER t BEFORE INSERT ON event BEGIN SELECT RAISE(ABORT, 'no'); END": "the trigger 't'",
    "CREATE TRIGGER t BEFORE UPDATE ON head BEGIN SELECT no_such(); END": "the trigger 't' on 'head'",
    "CREATE TRIGGER event AFTER INSERT ON head BEGIN SELECT 1; END": "the trigger 'event' on 'head'",
    'CREATE TRIGGER "a ""b\'" AFTER DELETE ON event BEGIN SELECT 1; END': "the trigger",
    "CREATE VIEW v AS SELECT * FROM event": "the view 'v'",
    "CREATE VIEW v AS SELECT * FROM nowhere": "the view 'v'",
    "CREATE TABLE notes (id INTEGER PRIMARY KEY AUTOINCREMENT, text)": "the table 'notes'",
    "CREATE TABLE sqlitestudio (text UNIQUE)": "the table 'sqlitestudio'",
    "CREATE VIRTUAL TABLE words USING fts5(text)": "the table 'words'",
    "CREATE INDEX mine ON event (author)": "the index 'mine' on 'event'",
    "CREATE UNIQUE INDEX mine ON event (substr(stream, 1), seq)": "the index 'mine' on 'event'",
}
#: Statements that change what is ours, and what is said of it.
REFUSED: Final = {
    "ALTER TABLE event ADD COLUMN more TEXT": "the table 'event' is not as it should be",
    "ALTER TABLE head ADD COLUMN more TEXT DEFAULT 'x'": "the table 'head'",
    "DROP TABLE head; CREATE VIEW head AS SELECT * FROM event": "the view 'head' stands in the place",
    "DROP TABLE head": "the table 'head' is missing",
    "CREATE TABLE other AS SELECT * FROM head; DROP TABLE head; CREATE TABLE head (stream TEXT NOT NULL"
    ", seq BIGINT NOT NULL CHECK (seq < 3), chain BLOB NOT NULL, PRIMARY KEY (stream))": "the table 'head' is not",
}
BRANCHES: Final[tuple[Branch, ...]] = ("editor", "runner")


@pytest.fixture
def data(tmp_path: Path) -> Path:
    filled(tmp_path / "old", "Ada")
    return tmp_path / "old"


def execute(path: Path, sql: str) -> None:
    with closing(sqlite3.connect(path)) as connection:
        connection.executescript(sql)


def schema(path: Path) -> list[tuple[str, str]]:
    with closing(sqlite3.connect(path)) as connection:
        rows = connection.execute("SELECT type, name FROM sqlite_master").fetchall()
    return sorted(row for row in rows if row != ("table", "sqlite_sequence"))


def with_schema(file: Path, branch: Branch, sql: str) -> Path:
    """A backup that says what is in it, of which one journal has something more."""

    def change(about: dict[str, object], parts: dict[str, bytes]) -> None:
        path = file.with_name("part.db")
        path.write_bytes(parts[f"{branch}.db"])
        execute(path, sql)
        held = about["journals"][branch]  # type: ignore[index]
        parts[f"{branch}.db"] = content = path.read_bytes()
        held["sha256"], held["bytes"] = hashlib.sha256(content).hexdigest(), len(content)
        path.unlink()

    return changed(file, change)


@pytest.mark.long
@pytest.mark.parametrize(
    ("sql", "branch"), [*zip(DROPPED, itertools.cycle(BRANCHES), strict=False)]
)
def test_restore_drops_what_is_not_ours_and_says_so(
    data: Path, tmp_path: Path, sql: str, branch: Branch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert here("backup", tmp_path / "monday.zip", "--data", data) == 0
    bad = with_schema(tmp_path / "monday.zip", branch, sql)
    capfd.readouterr()
    assert main(["restore", "--rehearse", str(bad), "--data", str(data)]) == 1
    assert (
        f"NOT sound: {branch}: this program has not made {DROPPED[sql]}" in capfd.readouterr().out
    )
    assert main(["restore", str(bad), "--data", str(tmp_path / "new")]) == 0
    told = capfd.readouterr().out
    assert f"dropped, since this program has not made it: {branch}: {DROPPED[sql]}" in told
    assert schema(tmp_path / "new" / f"{branch}.db") == schema(data / f"{branch}.db")
    assert main(["verify", "--data", str(tmp_path / "new")]) == 0


@pytest.mark.turns
@pytest.mark.parametrize(
    ("sql", "branch"), [*zip(REFUSED, itertools.cycle(BRANCHES), strict=False)]
)
def test_restore_refuses_what_is_ours_and_was_altered(
    data: Path, tmp_path: Path, sql: str, branch: Branch, capfd: pytest.CaptureFixture[str]
) -> None:
    assert here("backup", tmp_path / "monday.zip", "--data", data) == 0
    bad = with_schema(tmp_path / "monday.zip", branch, sql)
    assert main(["restore", str(bad), "--data", str(tmp_path / "new")]) == 2
    told = capfd.readouterr().err
    assert f"The journal of the {branch} has another schema than this program makes" in told
    assert REFUSED[sql] in told
    assert not (tmp_path / "new" / f"{branch}.db").exists()


def test_a_schema_that_cannot_be_read_is_one_sentence(
    data: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    assert here("backup", tmp_path / "monday.zip", "--data", data) == 0
    sql = (
        "PRAGMA writable_schema=ON; INSERT INTO sqlite_master (type, name, tbl_name, rootpage, sql)"
        " VALUES ('table', 'x', 'x', 99999, 'CREATE TABEL x')"
    )
    bad = with_schema(tmp_path / "monday.zip", "editor", sql)
    assert main(["restore", str(bad), "--data", str(tmp_path / "new")]) == 2
    assert "malformed" in capfd.readouterr().err


@pytest.mark.long
@pytest.mark.parametrize("sql", [*DROPPED, *REFUSED])
def test_verify_names_what_is_not_ours_and_does_not_call_it_sound(
    data: Path, sql: str, capfd: pytest.CaptureFixture[str]
) -> None:
    execute(data / "runner.db", sql)
    assert main(["verify", "--data", str(data)]) != 0
    told = capfd.readouterr().out
    assert f"runner: {DROPPED.get(sql) or REFUSED[sql]}" in told
    assert "runner: 2 events" not in told


def test_a_backup_leaves_out_what_is_not_ours_and_says_so(
    data: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    execute(data / "editor.db", next(iter(DROPPED)))
    assert here("backup", tmp_path / "monday.zip", "--data", data) == 0
    assert "not this program's: editor: the trigger 't' on 'event'" in capfd.readouterr().err
    assert main(["restore", "--rehearse", str(tmp_path / "monday.zip"), "--data", str(data)]) == 0


@pytest.mark.parametrize("branch", BRANCHES)
def test_tables_and_indexes_of_sqlite_itself_are_not_foreign(data: Path, branch: Branch) -> None:
    execute(data / f"{branch}.db", "ANALYZE; VACUUM")
    assert foreign_schema.look(data / f"{branch}.db", branch).sentences() == []
