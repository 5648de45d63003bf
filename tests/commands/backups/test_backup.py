"""`backup` while the server runs, and `restore`, after which history is another one."""

import json
import shutil
import sqlite3
import zipfile
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest

from action_assistant.cli import parser
from action_assistant.editor.app import open_services
from action_assistant.errors import CannotStart
from action_assistant.settings import EditorSettings
from editor.process import Editor
from support.command_line import ran


@pytest.fixture
def editor(tmp_path: Path) -> Editor:
    """A running editor of one more graph than the examples."""
    editor = Editor(tmp_path / "data")
    editor.start()
    with editor.client() as http:
        http.post("/api/graphs", json={"name": "before"})
    return editor


def names(editor: Editor) -> set[str]:
    with editor.client() as http:
        return {each["name"] for each in http.get("/api/graphs").json()}


def epochs(editor: Editor) -> list[str]:
    with closing(sqlite3.connect(editor.data / "editor.db")) as database:
        rows = database.execute("SELECT body FROM event WHERE stream = 'epochs' ORDER BY seq")
        return [json.loads(body)["why"] for (body,) in rows]


@pytest.mark.long
def test_a_backup_of_a_running_server_restores_all_its_graphs(
    editor: Editor, tmp_path: Path
) -> None:
    file = tmp_path / "monday.zip"
    made = ran("backup", file, "--data", editor.data)
    assert made.returncode == 0, made.stderr
    assert file.stat().st_mode & 0o777 == 0o600
    with editor.client() as http:
        http.post("/api/graphs", json={"name": "after"})
    assert "after" in names(editor)
    refused = ran("restore", file, "--data", editor.data)
    assert (refused.returncode, "End action-assistant first" in refused.stderr) == (2, True)
    editor.kill()  # what its last words were must not enter the restored file
    assert (editor.data / "editor.db-wal").stat().st_size > 0

    restored = ran("restore", file, "--data", editor.data)
    assert restored.returncode == 0, restored.stderr
    editor.start()
    assert "before" in names(editor)
    assert "after" not in names(editor)
    editor.end()
    assert epochs(editor) == ["the first", "a backup was restored"]
    # The restore has kept the earlier files.
    (aside,) = editor.data.glob("before-restore-*")
    with closing(sqlite3.connect(aside / "editor.db")) as database:
        kept = {name for (name,) in database.execute("SELECT name FROM graph")}
    assert {"before", "after"} <= kept
    assert ran("verify", "--data", editor.data).returncode == 0


def here(*arguments: str | Path) -> int:
    """A command in this process."""
    options = parser().parse_args(list(map(str, arguments)))
    code: int = options.handler(options)
    return code


def cut(file: Path) -> None:
    file.write_bytes(file.read_bytes()[:-100])


def flip(file: Path) -> None:
    with zipfile.ZipFile(file) as archive:
        parts = {name: archive.read(name) for name in archive.namelist()}
    parts["editor.db"] = parts["editor.db"][:-1] + b"\1"
    with zipfile.ZipFile(file, "w") as archive:
        for name, content in parts.items():
            archive.writestr(name, content)


def replace(file: Path) -> None:
    file.write_bytes(b"not a backup")


@pytest.mark.parametrize("harm", [cut, flip, replace, Path.unlink])
def test_a_file_that_is_no_sound_backup_changes_nothing(
    data: Path, harm: Callable[[Path], None]
) -> None:
    file = data / "monday.zip"
    assert here("backup", file, "--data", data) == 0
    harm(file)
    before = (data / "editor.db").read_bytes()
    with pytest.raises(CannotStart):
        here("restore", file, "--data", data)
    assert (data / "editor.db").read_bytes() == before
    assert not list(data.glob("before-restore-*"))


def test_a_damaged_journal_is_not_called_a_backup(data: Path) -> None:
    with closing(sqlite3.connect(data / "editor.db")) as database, database:
        database.execute("UPDATE event SET author = 'eve' WHERE position = 3")
    with pytest.raises(CannotStart, match="people, event 3: it is not what was written"):
        here("backup", data / "x.zip", "--data", data)
    assert not (data / "x.zip").exists()


def test_a_folder_without_a_journal_is_one_sentence(tmp_path: Path) -> None:
    with pytest.raises(CannotStart, match="no journal"):
        here("backup", tmp_path / "x.zip", "--data", tmp_path)


async def test_files_that_somebody_copied_back_by_hand_begin_an_epoch_too(data: Path) -> None:
    settings = EditorSettings(data=data, database=f"sqlite:///{data / 'editor.db'}")

    async def epoch(*, more: bool = False) -> str:
        async with open_services(settings) as services:
            if more:
                await services.catalogue.create(b'{"name": "after"}', "ada")
            return services.epoch

    first = await epoch()
    shutil.copy(data / "editor.db", data / "copy")
    assert await epoch(more=True) == first
    shutil.copy(data / "copy", data / "editor.db")
    second = await epoch()
    assert second != first
    assert await epoch(more=True) == second
