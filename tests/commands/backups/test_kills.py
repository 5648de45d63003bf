"""kill -9 in a backup and in a restore, at any moment: no file that looks whole and is not, nothing lost."""

import os
import random
import shutil
import signal
import subprocess
import time
from pathlib import Path
from typing import Final

import pytest

from action_assistant import settings
from action_assistant.journal.databases import database_of, migrate
from action_assistant.journal.sqlite import inspected
from support.command_line import ran, seconds_of
from support.product import COMMAND
from support.rows import write_events

KILLS: Final = int(os.environ.get("TEST_BACKUP_KILLS", "2"))
EVENTS: Final = 2_000


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with two journals."""
    folder = tmp_path / "data"
    folder.mkdir()
    for branch in ("editor", "runner"):
        url = f"sqlite:///{folder / f'{branch}.db'}"
        migrate(url, branch)  # type: ignore[arg-type]
        database_of(url).migrate(lambda c: write_events(c, each=EVENTS // 3))
    (folder / "token").write_text("of this folder".ljust(43, "-"))
    return folder


def killed(after: float, *arguments: "str | Path") -> None:
    process = subprocess.Popen(
        [*COMMAND, *map(str, arguments)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    time.sleep(after)
    process.send_signal(signal.SIGKILL)
    process.wait()


def sound(folder: Path) -> dict[str, int]:
    """Return how many events each journal holds; each of them has to be sound."""
    found = {}
    for branch in ("editor", "runner"):
        path = folder / f"{branch}.db"
        if path.exists():
            found[branch], damages = inspected(path)
            assert damages == []
    return found


@pytest.mark.long
@pytest.mark.timeout(0)
def test_a_killed_backup_leaves_no_file_and_harms_nothing(data: Path, tmp_path: Path) -> None:
    into, chance = tmp_path / "b", random.Random(5)
    takes = seconds_of("backup", "--into", into, "--keep", "all", "--data", data)
    before = sound(data)
    for _ in range(KILLS):
        known = set(into.glob("*.zip"))
        killed(
            takes * chance.uniform(0.3, 1.0),
            "backup",
            "--into",
            into,
            "--keep",
            "all",
            "--data",
            data,
        )
        assert sound(data) == before
        for path in set(into.glob("*.zip")) - known:  # it was there before it was killed
            assert ran("restore", "--rehearse", path, "--data", data).returncode == 0
        time.sleep(1.0)  # names have seconds
    assert ran("backup", "--into", into, "--keep", "all", "--data", data).returncode == 0
    assert not list(into.glob(".backup-*"))


@pytest.mark.timeout(0)
def test_a_killed_restore_leaves_all_as_it_was_or_whole_or_marked(
    data: Path, tmp_path: Path
) -> None:
    file, chance = tmp_path / "x.zip", random.Random(6)
    assert ran("backup", file, "--data", data).returncode == 0
    whole = sound(data)
    whole["editor"] += 1  # that another epoch begins
    takes, outcomes = seconds_of("restore", file, "--data", tmp_path / "timed"), set()
    for number in range(KILLS):
        place = tmp_path / f"place{number}"
        old = {}
        if number % 2:  # what is there is another one
            place.mkdir()
            migrate(f"sqlite:///{place / 'editor.db'}", "editor")
            database_of(f"sqlite:///{place / 'editor.db'}").migrate(write_events)
            old = sound(place)
        killed(takes * chance.uniform(0.3, 1.0), "restore", file, "--data", place)
        marked = (place / settings.RESTORING).exists()
        now = sound(place)
        outcomes.add("marked" if marked else "whole" if now == whole else "as before")
        assert marked or now in (old, whole)
        again = ran("restore", file, "--data", place)
        assert again.returncode == 0, again.stderr
        assert sound(place) == whole
        assert not list(place.glob(".restore-*"))
        shutil.rmtree(place)
    assert len(outcomes) > (KILLS > 9)
