"""`doctor` on databases in files that are broken for real."""

import sqlite3
import subprocess
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from action_assistant.commands.doctor import database_checks
from action_assistant.editor.log import database_location
from action_assistant.journal.copies import before_upgrade
from action_assistant.journal.migrate import revisions_of
from support.command_line import ran
from support.doctor import fault, faults


def altered(file: Path, *commands: str) -> None:
    """A database after somebody has written into it behind our back."""
    with closing(sqlite3.connect(file)) as database:
        for each in commands:
            database.execute(each)
        database.commit()


@contextmanager
def holding(lock: Path, *program: str) -> Iterator[int]:
    """A process that has locked a file; its number."""
    command = ["flock", "--no-fork", str(lock), "sh", "-c", "echo held; cat; true", *program]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == b"held\n"
        yield process.pid
        process.communicate()


@pytest.mark.parametrize("branch", ["editor", "runner"])
def test_tables_of_a_newer_version_are_named(data: Path, branch: str) -> None:
    altered(data / f"{branch}.db", f"UPDATE alembic_version SET version_num = '{branch}_9999'")
    found = fault(data)
    assert (found.code, found.where) == ("schema-newer", str(data / f"{branch}.db"))
    assert f"{branch}_9999" in found.message
    assert found.remedy.startswith("Install that version again")


@pytest.mark.parametrize("branch", ["editor", "runner"])
def test_what_the_next_start_changes_is_said_before(data: Path, branch: str) -> None:
    older, newest = revisions_of(branch)[-2:]
    altered(data / f"{branch}.db", f"UPDATE alembic_version SET version_num = '{older}'")
    found = fault(data)
    assert (found.code, found.where) == ("schema-older", str(data / f"{branch}.db"))
    assert f"those of {older}; the next start changes them to {newest} (" in found.message
    assert "for which there is room" in found.message


def test_before_an_upgrade_one_asks_only_what_it_changes_and_needs(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def asked() -> tuple[int, str]:
        answer = ran("doctor", "--before-upgrade", "--data", data)
        return answer.returncode, answer.stdout

    def contents() -> dict[Path, bytes]:
        return {each: each.read_bytes() for each in data.iterdir() if each.is_file()}

    before = contents()
    code, said = asked()
    assert code == 0
    assert "The next start changes no tables, and makes no copy." in said
    assert "port" not in said, "the rest of this computer is not asked"
    assert contents() == before
    for branch in ("editor", "runner"):
        older = revisions_of(branch)[-3]
        altered(data / f"{branch}.db", f"UPDATE alembic_version SET version_num = '{older}'")
    code, said = asked()
    assert code == 0, "what an upgrade does is a warning"
    assert "(people of rooms, folders of editors), after a copy of" in said
    assert "(outbox, notes at moments), after a copy of" in said
    assert "MiB there before it changes tables; with what has to stay free it needs" in said
    one = max((data / f"{branch}.db").stat().st_size for branch in ("editor", "runner"))
    monkeypatch.setattr(database_checks, "_bytes_left", lambda _: one + before_upgrade.ROOM)
    code, said = asked()
    short = [line for line in said.splitlines() if "[schema-room]" in line]
    assert (code, len(short)) == (1, 1), "there is room for each, and not for both"
    assert f"✗ {data / before_upgrade.FOLDER}: " in short[0]


def test_an_upgrade_without_room_for_its_copy_is_an_error(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    older = revisions_of("editor")[-2]
    altered(data / "editor.db", f"UPDATE alembic_version SET version_num = '{older}'")
    monkeypatch.setattr(before_upgrade, "ROOM", 1 << 60)
    found = fault(data)
    assert (found.code, found.where) == ("schema-room", str(data / "editor.db"))
    assert "MiB are left" in found.message


def test_a_database_of_another_program_and_one_that_is_none_are_told_apart(data: Path) -> None:
    (data / "editor.db").unlink()
    (data / "editor.db").touch(mode=0o600)
    altered(data / "editor.db", "CREATE TABLE holidays (name TEXT)")
    assert fault(data).code == "database-foreign"
    (data / "editor.db").write_bytes(b"no database at all" * 100)
    found = fault(data)
    assert found.code == "database-unreadable"
    assert "file is not a database" in found.message


def test_a_database_of_graphs_that_is_gone_is_named_beside_its_runs(data: Path) -> None:
    (data / "editor.db").unlink()
    found = fault(data)
    assert found.code == "database-lost"
    assert "does not remember" in found.message, "its mark tells"
    (data / "editor.mark").unlink()
    found = fault(data)
    assert (found.code, found.where) == ("database-lost", str(data / "editor.db"))
    assert "restore a backup" in found.remedy


def test_a_remembered_file_that_is_gone_is_named(data: Path, tmp_path: Path) -> None:
    database_location.remember(data, f"sqlite:///{tmp_path / 'disk' / 'graphs.db'}")
    found = fault(data)
    assert (found.code, found.where) == ("database-lost", str(tmp_path / "disk" / "graphs.db"))


def test_a_database_of_runs_that_is_gone_is_named_beside_its_archives(data: Path) -> None:
    (data / "runner.db").unlink()
    (data / "archive" / "2026").mkdir(parents=True, mode=0o700)
    (data / "archive").chmod(0o700)
    found = fault(data)
    assert (found.code, found.where) == ("database-lost", str(data / "runner.db"))


def test_an_address_that_names_no_database_is_named(data: Path) -> None:
    assert fault(data, database="mysql://me:hunter2@host/x").code == "database-url"
    assert "hunter2" not in str(faults(data, database="mysql://me:hunter2@host/x"))


def test_an_event_that_was_altered_or_is_missing_is_named_with_its_place(data: Path) -> None:
    altered(data / "runner.db", "UPDATE event SET body = x'00' WHERE position = 1")
    found = fault(data)
    assert (found.code, found.where) == ("events-damaged", str(data / "runner.db"))
    assert "was altered" in found.message
    assert "action-assistant verify" in found.remedy


def test_a_stream_that_was_cut_off_is_named(data: Path) -> None:
    last = "SELECT max(position) FROM event WHERE stream LIKE 'graph/%'"
    altered(data / "editor.db", f"DELETE FROM event WHERE position = ({last})")
    found = fault(data)
    assert found.code == "events-damaged"
    assert "is written down to end at" in found.message


def test_events_of_tomorrow_tell_of_a_clock_that_is_behind(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = time.time
    monkeypatch.setattr(time, "time", lambda: real() - 5 * 3600)
    found = {each.where: each for each in faults(data)}
    assert {each.code for each in found.values()} == {"clock-wrong"}
    assert set(found) == {str(data / "editor.db"), str(data / "runner.db")}
    assert all("are 5 h in the future" in each.message for each in found.values())
    monkeypatch.setattr(time, "time", lambda: real() - 20 * 365 * 86_400)
    assert "clock" in {each.where for each in faults(data)}, "earlier than the program itself"


def test_a_lock_that_another_program_holds_is_named_with_its_process(data: Path) -> None:
    with holding(data / "editor.db.lock") as pid:
        found = fault(data)
    assert found.code == "journal-held"
    assert f"Process {pid} of " in found.message
    assert f"ps -p {pid}" in found.remedy


def test_a_folder_that_is_served_at_another_port_is_told_as_that(data: Path) -> None:
    with holding(data / "runner.db.lock", "action-assistant") as pid:
        found = fault(data)
    assert (found.code, found.severity) == ("served-elsewhere", "warning")
    assert f"Process {pid} of " in found.message


def test_a_check_that_fails_or_takes_too_long_ends_no_other(
    data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from action_assistant.commands.doctor import doctor
    from action_assistant.commands.doctor.installation import Installation

    def broken(_: Installation) -> list[object]:
        raise ZeroDivisionError("of the check")

    def slow(_: Installation) -> list[object]:
        time.sleep(5)
        return []

    checks = (broken, slow, doctor.CHECKS[0])
    place = Installation(data=data)
    found = list(doctor.examine(place, checks, seconds=0.5))  # type: ignore[arg-type]
    assert [each.code for each in found] == ["check-failed", "check-unfinished", ""]
    assert "ZeroDivisionError" in found[0].message
