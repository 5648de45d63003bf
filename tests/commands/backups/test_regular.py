"""Backups into a folder: by cron or by the server itself, rotated, taken elsewhere, and told."""

import signal
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from action_assistant.journal.copies.backup_state import BackupState, backup_state
from action_assistant.journal.databases import database_of, migrate
from support.command_line import ran
from support.product import COMMAND, running
from support.rows import write_events


@pytest.fixture
def data(tmp_path: Path) -> Path:
    """A folder with both journals, of which one holds events."""
    folder = tmp_path / "data"
    folder.mkdir()
    for branch in ("editor", "runner"):
        migrate(f"sqlite:///{folder / f'{branch}.db'}", branch)  # type: ignore[arg-type]
    database_of(f"sqlite:///{folder / 'editor.db'}").migrate(write_events)
    return folder


def state_of(data: Path) -> BackupState:
    state = backup_state(data)
    assert state is not None
    return state


def backups(folder: Path) -> list[Path]:
    return sorted(folder.glob("*.zip"))


def until(holds: Callable[[], Any]) -> None:
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_new_backup_goes_into_the_folder_and_older_ones_are_removed(
    data: Path, tmp_path: Path
) -> None:
    into = tmp_path / "backups"
    into.mkdir()
    old = into / "action-assistant-20200101-000000Z.zip"
    old.write_text("of long ago")
    strange = into / "holiday.zip"
    strange.write_text("not ours")
    made = ran("backup", "--into", into, "--keep", "1d", "--data", data)
    assert made.returncode == 0, made.stderr
    (new,) = [path for path in backups(into) if path != strange]
    assert new != old
    assert strange.exists()
    last = state_of(data).last
    assert last is not None
    assert (last.file, last.bytes, last.events) == (
        str(new),
        new.stat().st_size,
        {"editor": 12, "runner": 0},
    )
    assert last.proven
    assert last.off_site is None


def test_an_incomplete_backup_removes_no_older_one(data: Path, tmp_path: Path) -> None:
    """The older one may have it."""
    into = tmp_path / "b"
    into.mkdir()
    old = into / "action-assistant-20200101-000000Z.zip"
    old.write_text("of long ago")
    link = "INSERT INTO invitation VALUES ('i', 'viewer', 'team', 1, 'ann', NULL, NULL)"
    database_of(f"sqlite:///{data / 'editor.db'}").migrate(lambda c: c.exec_driver_sql(link))
    made = ran("backup", "--into", into, "--keep", "1d", "--data", data)
    assert made.returncode == 1
    assert "missing: the token" in made.stdout
    assert old.exists()


@pytest.mark.parametrize(
    ("after", "code", "why"),
    [
        ("cp --target-directory {there}", 0, None),
        ("sh -c 'echo no route to host >&2; exit 3'", 1, "ended with 3: no route to host"),
        ("no-such-program", 1, "cannot be run"),
    ],
)
def test_a_command_takes_it_elsewhere_and_its_failure_is_told(
    data: Path, tmp_path: Path, after: str, code: int, why: str | None
) -> None:
    there = tmp_path / "there"
    there.mkdir()
    made = ran(
        "backup", "--into", tmp_path / "b", "--after", after.format(there=there), "--data", data
    )
    assert made.returncode == code
    (here,) = backups(tmp_path / "b")
    last = state_of(data).last
    assert last is not None
    assert last.off_site is not None
    if why is None:
        assert (there / here.name).read_bytes() == here.read_bytes()
        assert last.off_site.why is None
    else:
        assert why in (last.off_site.why or "")
        assert "NOT taken elsewhere" in made.stderr


def test_a_backup_that_fails_is_written_down(data: Path, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    made = ran("backup", "--into", tmp_path / "file" / "b", "--data", data)
    assert made.returncode == 2
    failed = state_of(data).failed
    assert failed is not None
    assert "file" in failed.why


def test_backups_of_another_server_in_the_same_folder_stay(data: Path, tmp_path: Path) -> None:
    into, of_both = tmp_path / "b", []
    for token in ("one", "two", "one", "two"):
        (data / "token").write_text(token.ljust(43, "-"))
        made = ran("backup", "--into", into, "--keep", "1d", "--data", data)
        assert made.returncode == 0, made.stderr
        of_both.append(state_of(data).last)
    assert [str(each) for each in backups(into)] == [each.file for each in of_both[2:] if each]


def test_two_at_once_are_refused(data: Path, tmp_path: Path) -> None:
    into = tmp_path / "b"
    slow = subprocess.Popen(
        [
            *COMMAND,
            "backup",
            "--into",
            str(into),
            "--after",
            "sh -c 'sleep 30'",
            "--data",
            str(data),
        ]
    )
    try:
        until(lambda: backups(into))
        second = ran("backup", "--into", into, "--data", data)
        assert second.returncode == 2
        assert "just being made" in second.stderr
    finally:
        slow.terminate()
        slow.wait(20)


@pytest.mark.long
def test_the_server_makes_them_by_itself(tmp_path: Path) -> None:
    """Killed, the process that makes them comes again; and it ends with the server."""
    data, into = tmp_path / "data", tmp_path / "b"
    flags = ("--backup-to", str(into), "--backup-every", "1s", "--backup-keep", "all")
    with running(data, *flags) as product:
        until(lambda: len(backups(into)) >= 2)
        keeper = product.process("backup")
        assert keeper.nice() == 19
        keeper.kill()
        there = len(backups(into))
        until(lambda: len(backups(into)) >= there + 2)
        keeper = product.process("backup")
        schedule = state_of(data).schedule
        assert schedule is not None
        assert (schedule.into, schedule.every) == (str(into), 1.0)
        assert not state_of(data).is_late(time.time())
    assert not keeper.is_running()
    assert [path.name for path in into.iterdir() if path.name.startswith(".backup-")] == []
    rehearsed = ran("restore", "--rehearse", backups(into)[-1], "--data", data)
    assert rehearsed.returncode == 0, rehearsed.stdout


def test_a_backup_is_not_repeated_before_its_time(data: Path, tmp_path: Path) -> None:
    into = tmp_path / "b"
    assert ran("backup", "--into", into, "--data", data).returncode == 0
    staying = subprocess.Popen(
        [*COMMAND, "backup", "--into", str(into), "--every", "1h", "--data", str(data)]
    )
    try:
        until(lambda: state_of(data).schedule)
        schedule, last = state_of(data).schedule, state_of(data).last
        assert schedule is not None
        assert last is not None
        assert schedule.next == last.at + 3600
    finally:
        staying.send_signal(signal.SIGTERM)
        assert staying.wait(20) == 0
    assert len(backups(into)) == 1


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ([], "Name the file"),
        (["x.zip", "--into", "b"], "and not both"),
        (["--into", "b", "--every", "often"], "no time such as"),
        (["--into", "b", "--keep", "some"], "no rule such as"),
    ],
)
def test_wrong_or_contradicting_options_are_refused(
    data: Path, words: list[str], told: str
) -> None:
    refused = ran("backup", *words, "--data", data)
    assert (refused.returncode, told in refused.stderr) == (2, True)
