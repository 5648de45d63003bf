"""`verify` and `rebuild`, on a data folder as it lies."""

import sqlite3
from contextlib import closing
from pathlib import Path

import pytest

from action_assistant.cli import main, parser
from action_assistant.errors import CannotStart


def run(*arguments: str) -> int:
    options = parser().parse_args(arguments)
    code: int = options.handler(options)
    return code


def change(data: Path, sql: str) -> None:
    with closing(sqlite3.connect(data / "editor.db")) as connection, connection:
        connection.execute(sql)


def test_a_sound_journal_is_called_sound(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run("verify", "--data", str(data)) == 0
    assert capsys.readouterr().out == "editor: 3 events, all of them sound\n"


def test_damage_is_told_by_stream_and_event(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(data, "UPDATE event SET author = 'eve' WHERE seq = 2")
    assert run("verify", "--data", str(data)) == 1
    assert "people is sound up to 1; at event 2: it is not what" in capsys.readouterr().out


def test_tables_are_made_again(data: Path, capsys: pytest.CaptureFixture[str]) -> None:
    change(data, "DELETE FROM person")
    assert run("rebuild", "--data", str(data)) == 0
    assert capsys.readouterr().out == "editor: tables made again from 3 events\n"
    with closing(sqlite3.connect(data / "editor.db")) as connection:
        assert connection.execute("SELECT id, name FROM person").fetchall() == [
            ("ada", "Ada Lovelace")
        ]


def test_a_folder_without_a_journal_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match="no journal"):
        run("verify", "--data", str(tmp_path))


@pytest.mark.parametrize("newer", [False, True])
@pytest.mark.parametrize(
    "words", [("backup", "{}.zip"), ("verify",), ("verify", "--head"), ("audit", "verify")]
)
def test_what_only_reads_a_folder_at_rest_leaves_nothing_beside_its_databases(
    data: Path, words: tuple[str, ...], newer: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    if newer:
        change(data, "UPDATE alembic_version SET version_num = 'editor_9999'")
    before = {each.name: each.read_bytes() for each in data.glob("*.db*")}
    code = main([*(each.format(data.parent / "monday") for each in words), "--data", str(data)])
    assert {each.name: each.read_bytes() for each in data.glob("*.db*")} == before
    assert code == (2 if newer else 0)
    if newer:
        said = capsys.readouterr().err
        assert f"The database {data / 'editor.db'} was made by a newer version" in said
