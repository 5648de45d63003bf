"""Several processes write the state of backups, all read it, and no fault in it stops them."""

import threading
from pathlib import Path

import pytest

from action_assistant.journal.copies import backup_state as known
from action_assistant.journal.copies.backup_state import (
    BackupMade,
    BackupRehearsed,
    BackupSchedule,
    BackupState,
    backup_state,
)

MONDAY = BackupMade(
    at=1e9, file="/b/monday.zip", bytes=7, seconds=2, version="1", events={"editor": 3}
)
SOUND = BackupRehearsed(at=1e9, file="/b/monday.zip", bytes=7, seconds=1)
NOT_SOUND = BackupRehearsed(at=2e9, file="/b/monday.zip", bytes=7, seconds=1, why="damaged")


def test_the_state_of_a_folder_without_backups_is_empty(tmp_path: Path) -> None:
    assert backup_state(tmp_path) == BackupState()


@pytest.mark.parametrize(
    "text", [b"{", b'{"failed":{"at":1,"why":"\xff"}}', b'{"x":' + b"[" * 99_999]
)
def test_an_unreadable_state_is_not_an_empty_one(tmp_path: Path, text: bytes) -> None:
    (tmp_path / known.FILE).write_bytes(text)
    assert backup_state(tmp_path) is None
    known.made(tmp_path, MONDAY)
    assert backup_state(tmp_path) == BackupState(last=MONDAY)


def test_a_failure_stands_until_a_backup_is_made(tmp_path: Path) -> None:
    known.failed(tmp_path, "the disk is full")
    state = backup_state(tmp_path)
    assert state is not None
    assert state.failed is not None
    assert state.failed.why == "the disk is full"
    known.made(tmp_path, MONDAY)
    assert backup_state(tmp_path) == BackupState(last=MONDAY)


def test_the_last_proof_stays_when_a_later_rehearsal_finds_damage(tmp_path: Path) -> None:
    known.rehearsed(tmp_path, SOUND)
    known.rehearsed(tmp_path, NOT_SOUND)
    assert backup_state(tmp_path) == BackupState(rehearsed=NOT_SOUND, proven=SOUND)


def test_only_this_user_can_read_it(tmp_path: Path) -> None:
    known.made(tmp_path, MONDAY)
    assert [path.stat().st_mode & 0o077 for path in tmp_path.iterdir()] == [0, 0]


def test_concurrent_writers_lose_nothing_of_each_other(tmp_path: Path) -> None:
    writers = [
        threading.Thread(target=known.made, args=(tmp_path, MONDAY)),
        threading.Thread(target=known.rehearsed, args=(tmp_path, SOUND)),
    ]
    for each in writers:
        each.start()
    for each in writers:
        each.join()
    assert backup_state(tmp_path) == BackupState(last=MONDAY, rehearsed=SOUND, proven=SOUND)


def test_a_folder_that_cannot_be_written_fails_nothing(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    known.made(tmp_path / "gone", MONDAY)
    assert "cannot write" in caplog.text


@pytest.mark.parametrize(("now", "late"), [(1000, False), (4000, False), (5000, True)])
def test_a_backup_is_late_some_time_after_it_was_due(now: float, late: bool) -> None:
    schedule = BackupSchedule(into="/b", every=60, keep="7d", next=1000)
    assert BackupState(schedule=schedule).is_late(now) is late
    assert not BackupState().is_late(now)
