"""`restore --rehearse`: what is not sound is found, named, written down; and nothing is left behind."""

import json
import sqlite3
import subprocess
import zipfile
from contextlib import closing
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest

from action_assistant.journal.copies.backup_state import BackupState, backup_state
from support.command_line import ran
from support.product import COMMAND, running


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A backup of the example graphs, with a version."""
    folder = tmp_path_factory.mktemp("made")
    with running(folder / "data") as product, product.editor() as editor:
        graph = editor.get("/api/graphs").json()[0]["id"]
        editor.post(f"/api/graphs/{graph}/versions", json={}).raise_for_status()
    assert ran("backup", folder / "x.zip", "--data", folder / "data").returncode == 0
    return folder / "x.zip"


def changed(file: Path, target: Path, *commands: str) -> Path:
    """Return the same backup with a changed journal of the editor, whose sums are right."""
    with zipfile.ZipFile(file) as packed:
        parts = {name: packed.read(name) for name in packed.namelist()}
    journal = target.with_suffix(".db")
    journal.write_bytes(parts["editor.db"])
    with closing(sqlite3.connect(journal)) as database, database:
        for each in commands:
            database.execute(each)
    parts["editor.db"] = journal.read_bytes()
    journal.unlink()
    about: dict[str, Any] = json.loads(parts["about.json"])
    held = about["journals"]["editor"]
    held["sha256"], held["bytes"] = sha256(parts["editor.db"]).hexdigest(), len(parts["editor.db"])
    parts["about.json"] = json.dumps(about).encode()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in parts.items():
            packed.writestr(name, content)
    return target


@pytest.mark.long
def test_a_sound_one_is_proven_and_nothing_is_left(file: Path, tmp_path: Path) -> None:
    done = ran("restore", "--rehearse", file, "--data", tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    assert "5 graphs, 1 versions" in done.stdout
    state = backup_state(tmp_path)
    assert state is not None
    assert state.proven is not None
    assert state.proven == state.rehearsed
    assert state.proven.bytes == file.stat().st_size
    assert sorted(path.name for path in tmp_path.iterdir()) == ["backups.json", "backups.json.lock"]


@pytest.mark.parametrize(
    ("command_", "told"),
    [
        ("UPDATE event SET body = x'00' WHERE stream LIKE 'graph/%' AND seq = 1", "is damaged"),
        ("DELETE FROM event WHERE position = 3", "is damaged"),
        ("UPDATE version SET digest = 'another'", "has another digest"),
        ("UPDATE version SET event_seq = 99", "cannot be read"),
        ("UPDATE alembic_version SET version_num = 'editor_9999'", "newer version"),
    ],
)
def test_an_unsound_backup_is_named_and_recorded(
    file: Path, tmp_path: Path, command_: str, told: str
) -> None:
    bad = changed(file, tmp_path / "bad.zip", command_)
    done = ran("restore", "--rehearse", bad, "--data", tmp_path)
    assert done.returncode == 1
    assert told in done.stdout
    assert "is NOT sound" in done.stdout
    state = backup_state(tmp_path)
    assert state is not None
    assert state.rehearsed is not None
    assert told in (state.rehearsed.why or "")
    assert state.proven is None
    assert not list(tmp_path.glob(".rehearsal-*"))


def test_a_file_that_was_cut_is_not_sound(file: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.zip"
    cut.write_bytes(file.read_bytes()[:-100])
    assert ran("restore", "--rehearse", cut, "--data", tmp_path).returncode == 1
    gone = ran("restore", "--rehearse", tmp_path / "gone.zip", "--data", tmp_path)
    assert (gone.returncode, "There is no file" in gone.stderr) == (2, True)


def test_a_full_disk_says_nothing_about_the_backup(file: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(file) as packed:
        blocks = packed.getinfo("editor.db").file_size // 1024  # of 512 bytes: half of it
    rehearse = ["restore", "--rehearse", str(file), "--data", str(tmp_path)]
    done = subprocess.run(
        ["sh", "-c", f'ulimit -f {blocks}; exec "$@"', "sh", *COMMAND, *rehearse],
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    told = done.stdout + done.stderr
    assert (done.returncode, "cannot be told" in told, "NOT sound" in told) == (2, True, False), (
        told
    )
    assert backup_state(tmp_path) == BackupState()
