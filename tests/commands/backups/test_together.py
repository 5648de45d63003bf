"""Several at once: nobody sweeps away what another one works in."""

import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from action_assistant.commands.backups import data_folder
from action_assistant.commands.backups.data_folder import sweep, workshop
from action_assistant.errors import CannotStart
from action_assistant.journal.databases import database_of, migrate
from action_assistant.system import posix
from support.command_line import ran
from support.product import COMMAND
from support.rows import write_events


def held_up(seen: Callable[[], Any], *arguments: "str | Path") -> "subprocess.Popen[str]":
    """A command that stands still as soon as something is there."""
    process = subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    while not seen():
        assert process.poll() is None
        time.sleep(0.002)
    process.send_signal(signal.SIGSTOP)
    return process


def goes_on(process: "subprocess.Popen[str]") -> tuple[int, str]:
    process.send_signal(signal.SIGCONT)
    told = "".join(process.communicate(timeout=60))
    return process.returncode, told


@pytest.fixture
def data(tmp_path: Path) -> Path:
    folder = tmp_path / "data"
    folder.mkdir()
    url = f"sqlite:///{folder / 'editor.db'}"
    migrate(url, "editor")
    database_of(url).migrate(lambda c: write_events(c, each=1_500))
    return folder


@pytest.mark.long
def test_a_regular_backup_leaves_alone_one_that_is_just_being_made_there(
    data: Path, tmp_path: Path
) -> None:
    into = tmp_path / "into"
    into.mkdir()
    by_hand = held_up(
        lambda: list(into.glob(".backup-*/editor.db")), "backup", into / "m.zip", "--data", data
    )
    assert ran("backup", "--into", into, "--data", data).returncode == 0
    code, told = goes_on(by_hand)
    assert code == 0, told
    assert not list(into.glob(".backup-*"))


@pytest.mark.long
def test_two_rehearsals_see_all_that_is_in_the_backup(data: Path, tmp_path: Path) -> None:
    file = tmp_path / "m.zip"
    assert ran("backup", file, "--data", data).returncode == 0
    rehearse = "restore", "--rehearse", file, "--data", data
    first = held_up(lambda: list(data.glob(".rehearsal-*/editor.db")), *rehearse)
    other = ran(*rehearse)
    assert "editor: 4500 events" in other.stdout
    code, told = goes_on(first)
    assert (code, "editor: 4500 events" in told) == (0, True), told


def test_the_folder_of_a_killed_command_is_removed(tmp_path: Path) -> None:
    left = tmp_path / ".work-left"
    left.mkdir()
    (left / "editor.db").write_bytes(b"")
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    (tmp_path / ".work-link").symlink_to(elsewhere)
    with workshop(tmp_path, ".work-") as folder:
        sweep(tmp_path, ".work-")
        assert folder.is_dir()
        assert not left.exists()
    assert sorted(each.name for each in tmp_path.iterdir()) == [".work-link", "elsewhere"]
    assert list(elsewhere.iterdir()) == []


def test_a_command_whose_folder_is_just_being_removed_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Between the folder and its lock there is a moment: a sweeper that comes then has the lock."""
    opened = data_folder.opener

    def meanwhile(path: str, flags: int) -> int:
        held = opened(path, flags)
        posix.lock_file(held)
        return opened(path, flags)

    monkeypatch.setattr(data_folder, "opener", meanwhile)
    with pytest.raises(CannotStart, match="tidied up"), workshop(tmp_path, ".work-"):
        pytest.fail("it works where it is swept away")
