"""A data folder is closed to other users of the computer: they can neither see nor change anything in it."""

import fcntl
import json
import os
import shutil
import stat
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

import pytest

from action_assistant.errors import CannotStart
from action_assistant.journal.lock import own
from action_assistant.private_files import holds_nothing_else, open_to_others, own_folder
from support.product import COMMAND, running

pytestmark = pytest.mark.usefixtures("new_interpreters")

_NOBODY: Final = 65534
GRAPH = {
    "graph_name": "g",
    "graph_entry": [{"name": "A", "instance_id": 0}],
    "graph_exit": [{"name": "A", "instance_id": 0}],
    "actions": [{"name": "A", "instance_id": 0, "type": "sync"}],
}


def modes(data: Path) -> dict[str, str]:
    """Return the modes of files that others may use, by name."""
    return {
        str(path.relative_to(data.parent)): stat.filemode(path.stat().st_mode)
        for path in (data, *data.rglob("*"))
        if path.stat().st_mode & 0o077
    }


@pytest.mark.long
def test_all_files_of_a_data_folder_belong_to_this_user_alone(tmp_path: Path) -> None:
    data = tmp_path / "data"
    before = os.umask(0)
    try:
        with running(data, "--tls") as product:
            file = tmp_path / "g.json"
            file.write_text(json.dumps(GRAPH))
            assert product.cli("import", str(file), "--data", str(data)).returncode == 0
            assert product.cli("run", "g", "--data", str(data)).returncode == 0
            archive = product.cli("runs", "archive", "--runs", "0", "--data", str(data))
            assert archive.returncode == 0, archive.stderr
            while_in_use = modes(data)
        backup = tmp_path / "backup.zip"
        made = product.cli("backup", str(backup), "--data", str(data))
        assert made.returncode == 0, made.stderr
        assert stat.S_IMODE(backup.stat().st_mode) == 0o600
        back = tmp_path / "back"
        assert product.cli("restore", str(backup), "--data", str(back)).returncode == 0
        for folder in ("recordings", "archive"):
            assert (data / folder).is_dir() or folder == "recordings"
    finally:
        os.umask(before)
    assert while_in_use == modes(data) == modes(back) == {}


@pytest.mark.long
def test_a_folder_of_an_older_version_is_closed_and_doctor_tells(tmp_path: Path) -> None:
    data = tmp_path / "data"
    for name in ("archive/2026/a.gz", "recordings/David/b.gz", "editor.db", "runner.db-wal"):
        (data / name).parent.mkdir(parents=True, exist_ok=True)
        (data / name).touch()
    for path in (data, *data.rglob("*")):
        path.chmod(0o755 if path.is_dir() else 0o644)
    doctor = [*COMMAND, "doctor", "--only", "machine", "--json", "--data", str(data)]

    def told() -> dict[str, str]:
        answer = subprocess.run(doctor, capture_output=True, check=False)
        return {each["code"]: each["message"] for each in json.loads(answer.stdout)}

    assert "editor.db" in told()["folder-readable"]
    assert len(open_to_others(data)) == 9, "looking changes nothing"
    own_folder(data)
    assert modes(data) == {}
    assert "folder-readable" not in told()


def test_the_locks_of_editors_in_containers_let_a_folder_be_closed(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir(mode=0o755)
    for name in ("editor.db", "editor-1.lock", "editor-12.lock"):
        (data / name).touch(mode=0o644)
    own_folder(data)
    assert modes(data) == {}


def test_a_folder_with_other_things_in_it_is_left_as_it_is(tmp_path: Path) -> None:
    """The folder may be a person's home, or one that belongs to all."""
    home = tmp_path / "home"
    home.mkdir(mode=0o755)
    (home / "holidays.jpg").touch(mode=0o644)
    (home / "editor.db").touch(mode=0o644)
    (home / "sessions").symlink_to(tmp_path)
    tmp_path.chmod(0o755)
    own_folder(home)
    assert not holds_nothing_else(home)
    assert sorted(modes(home)) == ["home", "home/holidays.jpg", "home/sessions"]
    assert stat.S_IMODE(tmp_path.stat().st_mode) == 0o755


@pytest.fixture
def public() -> Iterator[Path]:
    """A folder that every user of this computer reaches."""
    folder = Path(tempfile.mkdtemp(prefix="aa-public-"))
    folder.chmod(0o755)
    yield folder
    shutil.rmtree(folder)


@contextmanager
def held(lock: Path, user: int | None) -> Iterator[int]:
    """Another process, of this user, holds a lock; its number."""
    process = subprocess.Popen(
        ["flock", "--no-fork", str(lock), "sh", "-c", "echo held; exec cat"],
        user=user,
        cwd="/",
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    )
    with process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        yield process.pid
        process.kill()


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can be somebody else")
def test_a_lock_that_another_user_holds_stops_nobody(public: Path) -> None:
    """Earlier versions made locks that everybody could read, and therefore lock."""
    lock = public / "runner.db.lock"
    lock.touch(mode=0o644)
    (public / "runner.db").touch(mode=0o644)
    with held(lock, _NOBODY):
        mine = own(public / "runner.db")
        with pytest.raises(CannotStart, match="in use by another process"):
            own(public / "runner.db")
        os.close(mine)
        os.close(own(public / "runner.db"))
    assert stat.S_IMODE(lock.stat().st_mode) == 0o600


def test_a_lock_of_ones_own_is_respected_and_its_holder_named(tmp_path: Path) -> None:
    lock = tmp_path / "runner.db.lock"
    lock.touch()
    with (
        held(lock, None) as pid,
        pytest.raises(CannotStart, match=rf"in use by another process \({pid} of \w+\)"),
    ):
        own(tmp_path / "runner.db")
    descriptor = own(tmp_path / "runner.db")
    with lock.open() as other, pytest.raises(BlockingIOError):
        fcntl.flock(other, fcntl.LOCK_EX | fcntl.LOCK_NB)
    os.close(descriptor)
