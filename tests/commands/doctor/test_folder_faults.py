"""`doctor` on data folders that are broken for real, and on settings that cannot be meant."""

import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from action_assistant.journal.copies import backup_state
from support.doctor import asked, fault, faults

NOBODY = 65_534


def test_a_sound_folder_has_nothing_wrong_and_is_not_altered(data: Path) -> None:
    def contents() -> dict[str, tuple[bytes, float]]:
        files = (each for each in data.rglob("*") if each.is_file())
        return {str(each): (each.read_bytes(), each.stat().st_mtime) for each in files}

    before, folder = contents(), data.stat().st_mtime_ns
    assert faults(data) == []
    assert contents() == before
    assert data.stat().st_mtime_ns == folder, "not even a probe was made"


def test_a_folder_that_is_not_there_yet_is_as_it_should_be_and_is_not_made(tmp_path: Path) -> None:
    assert faults(tmp_path / "below" / "data") == []
    assert not (tmp_path / "below").exists()


def test_an_empty_folder_that_all_may_read_is_as_it_should_be(tmp_path: Path) -> None:
    (tmp_path / "data").mkdir(mode=0o755)
    assert faults(tmp_path / "data") == []
    (tmp_path / "data" / "mine.txt").write_text("of somebody else")
    assert fault(tmp_path / "data").code == "folder-readable"


def test_a_file_in_the_way_of_the_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    found = {each.code: each for each in faults(tmp_path / "file")}
    assert found["folder-unusable"].message == f"{tmp_path / 'file'} is no folder."


def test_a_folder_that_somebody_may_not_enter_is_named_with_its_owner(data: Path) -> None:
    if os.geteuid() != 0:
        data.chmod(0)
        found = {each.code: each for each in faults(data)}
        assert "cannot read and write" in found["folder-unusable"].message
        return
    # Root may enter everything: somebody else looks.
    look = (
        "import os, sys; from pathlib import Path;"
        "from action_assistant.commands.doctor.machine_checks import folder_is_ours;"
        "from action_assistant.commands.doctor.installation import Installation;"
        f"os.chdir('/'); os.setgroups([]); os.setgid({NOBODY}); os.setuid({NOBODY});"
        "[print(each.code, each.message, each.remedy) for each in "
        "folder_is_ours(Installation(data=Path(sys.argv[1])))]"
    )
    # The other user has to reach the folder, too.
    public = Path(f"/var/tmp/aa-doctor-{os.getpid()}")
    shutil.move(data, public)
    try:
        command = [sys.executable, "-c", look, str(public)]
        said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    finally:
        shutil.move(public, data)
    assert said.startswith("folder-unusable nobody cannot read and write in")
    assert "which is root's" in said
    assert "Run this program as root" in said


@pytest.mark.skipif(os.geteuid() != 0, reason="only root gives files to others")
def test_files_that_a_start_by_another_user_left_are_named_with_the_way_back(data: Path) -> None:
    os.chown(data / "runner.db", NOBODY, NOBODY)
    found = fault(data)
    assert found.code == "folder-of-others"
    assert found.message.startswith("runner.db is nobody's, the folder is root's")
    assert f"chown -R root {data}" in found.remedy


def test_a_token_that_others_can_read_is_named_apart_from_other_files(data: Path) -> None:
    (data / "token").chmod(0o644)
    found = fault(data)
    assert (found.code, found.where) == ("token-readable", str(data / "token"))
    assert "chmod 600" in found.remedy
    (data / "token").chmod(0o600)
    (data / "runner.db").chmod(0o640)
    found = fault(data)
    assert found.code == "folder-readable"
    assert "runner.db" in found.message


def test_a_missing_token_of_a_folder_that_was_served_is_named(data: Path) -> None:
    (data / "token").unlink()
    assert fault(data).code == "token-missing"
    (data / "token").touch(mode=0o600)
    (data / "token").write_text("short\n")
    assert fault(data).code == "token-unusable"


def test_small_files_that_hold_nothing_readable_are_named(data: Path) -> None:
    for name in ("people/mari.json", "tokens/aaaaaaaaaaaa.json", "graph-rules.json"):
        (data / name).parent.mkdir(mode=0o700, exist_ok=True)
        (data / name).touch(mode=0o600)
        (data / name).write_bytes(b'{"id":"\xff"}')
    found = fault(data)
    assert found.code == "file-unreadable"
    assert all(name in found.message for name in ("mari.json", "aaaaaaaaaaaa", "graph-rules"))


def test_a_restore_that_was_interrupted_is_named(data: Path) -> None:
    (data / "restore.unfinished").touch(mode=0o600)
    found = fault(data)
    assert found.code == "restore-unfinished"
    assert "action-assistant restore" in found.remedy


def test_an_archive_that_cannot_be_used_is_named(
    data: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "disk").write_text("no folder")
    monkeypatch.setenv("ACTION_ASSISTANT_ARCHIVE", str(tmp_path / "disk" / "archive"))
    found = fault(data)
    assert found.code == "archive-unusable"
    assert "ACTION_ASSISTANT_ARCHIVE" in found.remedy
    monkeypatch.setenv("ACTION_ASSISTANT_ARCHIVE", str(tmp_path / "disk"))
    assert fault(data).message.startswith("Runs cannot go into the archive")


def test_a_disk_that_is_nearly_full_is_named(data: Path, small_disk: Callable[[str], Path]) -> None:
    place = small_disk("60m") / "data"
    shutil.copytree(data, place)
    found = fault(place)
    assert found.code == "disk-full"
    assert "MiB left" in found.message


def test_settings_that_nobody_reads_or_that_mean_nothing_are_named(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("ACTION_ASSISTANT_KEEP_RUN", "90")
    monkeypatch.setenv("ACTION_ASSISTANT_KEEP_RAW", "a week")
    wrong = {
        "LIMITS": "of",
        "HOSTS": "http://lab/",
        "TOKEN": "guess-me",
        "TOKEN_FILE": "/nothing",
        "URL": "lab:8000",
        "PUBLIC_URL": "robots.example.org",
        "PORT": "eight thousand",
        "LOG_LEVEL": "loud",
        "METRICS_TOKEN": "short",
        "INDEX_FOLDERS": "/without/a/robot",
        "BACKUP_EVERY": "daily",
        "BACKUP_KEEP": "some",
    }
    for name, value in wrong.items():
        monkeypatch.setenv(f"ACTION_ASSISTANT_{name}", value)
    found = {each.where: each for each in faults(data)}
    assert found.pop("ACTION_ASSISTANT_KEEP_RUN").remedy.startswith(
        "Is ACTION_ASSISTANT_KEEP_RUNS meant?"
    )
    assert {each.code for each in found.values()} == {"setting-wrong"}
    assert set(found) == {f"ACTION_ASSISTANT_{name}" for name in ("KEEP_RAW", *wrong)}


def test_the_command_tells_a_wrong_setting_where_every_other_one_only_refuses(data: Path) -> None:
    flags = ("--only", "machine", "--port", "9")
    code, found = asked(data, *flags, ACTION_ASSISTANT_DATBASE="x")
    assert (code, [each["code"] for each in found]) == (1, ["setting-unknown"])
    assert set(found[0]) == {"code", "severity", "where", "message", "remedy"}
    code, found = asked(data, *flags, ACTION_ASSISTANT_RUNNER_PYTHON=str(data / "nothing"))
    assert (code, found[0]["code"]) == (1, "setting-wrong")
    assert "is no program" in found[0]["message"]
    assert asked(data, *flags) == (0, [])


def test_missing_and_late_backups_are_named_once_there_is_something_to_lose(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def made(days_ago: float) -> backup_state.BackupMade:
        at = time.time() - days_ago * 86_400
        return backup_state.BackupMade(
            at=at, file="b.zip", bytes=1, seconds=1, version="0", events={}
        )

    def known(state: backup_state.BackupState) -> None:
        backup_state.note(data, lambda _: state)

    known(backup_state.BackupState(last=made(1)))
    assert faults(data) == []
    known(backup_state.BackupState(last=made(40)))
    assert fault(data).code == "backup-old"
    failed = backup_state.BackupFailed(time.time(), "the disk was full")
    known(backup_state.BackupState(last=made(1), failed=failed))
    assert "the disk was full" in fault(data).message
    late = backup_state.BackupSchedule(into="/b", every=60, keep="7", next=time.time() - 9000)
    known(backup_state.BackupState(last=made(1), schedule=late))
    assert fault(data).code == "backup-old"
    (data / backup_state.FILE).write_text("{")
    assert fault(data).code == "backup-missing"


def test_a_folder_in_use_for_weeks_without_a_backup_is_told(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() + 8 * 86_400)
    found = fault(data)
    assert (found.code, found.severity) == ("backup-missing", "warning")
    assert "8 days" in found.message
