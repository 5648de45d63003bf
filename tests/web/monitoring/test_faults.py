"""Faults that are told without Prometheus."""

import time
from collections.abc import AsyncIterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from sqlalchemy import select

from action_assistant.journal.copies.backup_state import (
    BackupFailed,
    BackupSchedule,
    BackupState,
)
from action_assistant.journal.events import nothing
from action_assistant.journal.journal import Journal
from action_assistant.schema import editor_tables
from action_assistant.system.served_addresses import published
from action_assistant.web.monitoring import faults
from action_assistant.web.monitoring.faults import (
    FaultWatch,
    Hang,
    OwnCertificateLook,
    certificate_faults,
    hang_faults,
    note_hang,
    other_faults,
    own_faults,
    storage_faults,
    watch_of,
)
from action_assistant.web.monitoring.storage import Storage
from action_assistant.web.network.certificate import Certificate
from action_assistant.web.notifications.receivers import Mailbox
from web.notifications.receiving import http_receiver

pytestmark = pytest.mark.anyio

DAY = 24 * 3600.0


def mailbox(name: str, kind: str) -> Mailbox:
    """Return a receiver of one kind of messages."""
    return Mailbox(
        name=name,
        kinds=frozenset({kind}),
        host="mail.example.org",
        port=587,
        security="starttls",
        sender="a@example.org",
        to=("b@example.org",),
    )


RECEIVERS = (mailbox("chat", "server.fault"), mailbox("others", "mention"))


@pytest.fixture
async def journal(tmp_path: Path) -> AsyncIterator[Journal]:
    """A journal of an editor."""
    opened = await Journal.open(
        f"sqlite:///{tmp_path / 'editor.db'}", branch="editor", fold=nothing
    )
    yield opened
    await opened.close()


async def messages(journal: Journal) -> list[tuple[str, str]]:
    """Return receiver and subject of each message that waits."""
    columns = editor_tables.outbox.c
    rows = await journal.query(select(columns.receiver, columns.subject).order_by(columns.at))
    return [(row.receiver, row.subject) for row in rows]


async def test_a_fault_that_lasts_is_told_once_a_day_to_who_wants_it(
    journal: Journal,
) -> None:
    now, texts = 1_000_000.0, {"disk": "Little is left."}

    async def look() -> dict[str, str]:
        return texts

    def watching() -> FaultWatch:
        return FaultWatch(journal, RECEIVERS, [look], clock=lambda: now)

    watch = watching()
    await watch.look()
    assert [each.text for each in watch.found] == ["Little is left."]
    assert await messages(journal) == []  # a restart of a process lasts less
    now += 61
    await watch.look()
    await watch.look()
    assert await messages(journal) == [("chat", "disk")]
    watch = watching()  # after a restart it is no news either
    await watch.look()
    now += 61
    await watch.look()
    assert await messages(journal) == [("chat", "disk")]
    now += DAY
    await watch.look()
    assert await messages(journal) == [("chat", "disk")] * 2
    texts = {}
    await watch.look()
    assert watch.found == ()


async def test_the_disk_that_both_processes_share_is_told_by_one(
    journal: Journal, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The runner tells it where no editor is beside it, or none that works."""
    monkeypatch.setattr(faults, "_LASTS_S", 0.0)
    little = Storage(at=0, free=1, size=10)
    watch = watch_of(
        "runner", tmp_path, journal, RECEIVERS, page="", tls=False, storage=lambda: (little, None)
    )
    with http_receiver() as editor:  # it answers, and names no part that is broken
        with published(tmp_path, "editor", f"http://127.0.0.1:{editor.port}"):
            await watch.look()
        assert [each.what for each in watch.found] == ["disk"]
        assert await messages(journal) == []
    await watch.look()
    assert await messages(journal) == [("chat", "disk")]


async def test_a_look_that_fails_hides_no_other(journal: Journal) -> None:
    async def broken() -> dict[str, str]:
        raise ValueError("broken")

    async def sound() -> dict[str, str]:
        return {"backup": "None was made."}

    watch = FaultWatch(journal, (), [broken, sound])
    await watch.look()
    assert [each.what for each in watch.found] == ["backup"]


def test_a_disk_is_nearly_full_by_its_bytes_or_its_share() -> None:
    def of(free: float, size: float) -> bool:
        found = Storage(at=0, free=round(free), size=round(size))
        return "disk" in storage_faults(found, None, 0)

    assert of(0.9e9, 10e9)
    assert of(4e9, 100e9)
    assert not of(6e9, 100e9)
    assert storage_faults(None, None, 0) == {}


def test_a_backup_that_failed_or_is_late_is_a_fault() -> None:
    plan = BackupSchedule(into="/b", every=DAY, keep="7d", next=1000.0)
    assert storage_faults(None, BackupState(schedule=plan), 1000.0) == {}
    late = storage_faults(None, BackupState(schedule=plan), 1000.0 + 2 * DAY)
    assert "overdue" in late["backup"]
    failed = BackupState(schedule=plan, failed=BackupFailed(1.0, "The disk is full."))
    assert "The disk is full." in storage_faults(None, failed, 1000.0)["backup"]


def test_a_certificate_is_named_two_weeks_before_it_ends() -> None:
    now = datetime(2026, 11, 28, tzinfo=UTC)
    assert certificate_faults("lab", now + timedelta(days=15), now) == {}
    assert (
        "ends on 2026-12-01"
        in certificate_faults("lab", now + timedelta(days=3), now)["certificate"]
    )
    assert "ended on" in certificate_faults("lab", now - timedelta(days=3), now)["certificate"]


async def test_the_own_certificate_of_a_server_that_runs_for_a_year_is_named(
    tmp_path: Path,
) -> None:
    now = datetime.now(UTC)
    own = Certificate(tmp_path)
    own.renew(["lab.local"], now=now - timedelta(days=390))
    look = OwnCertificateLook(tmp_path).look
    (text,) = (await look()).values()
    assert text.startswith("The certificate of this server ends on ")
    assert text.endswith(": start the program anew, which issues another.")
    own.renew(["lab.local"])
    assert await look() != {}, "it still listens with the one of its start"
    assert await OwnCertificateLook(tmp_path).look() == {}


def test_the_other_process_is_a_fault_only_where_it_should_be(tmp_path: Path) -> None:
    assert other_faults(tmp_path, "runner") == {}  # never served, or ended as usual
    with published(tmp_path, "runner", "http://127.0.0.1:1"):
        assert "NO STOP MAY ARRIVE" in other_faults(tmp_path, "runner")["runner"]
    assert other_faults(tmp_path, "runner") == {}


def test_a_part_that_works_is_no_fault() -> None:
    assert own_faults("editor", {"database": None, "rclpy": "rclpy is missing."}) == {}
    parts = {"database": "The database server does not answer.", "disk": None}
    assert own_faults("editor", parts) == {
        "editor": "The editor cannot do its work. The database server does not answer."
    }


def test_an_editor_that_was_ended_since_it_hung_is_shown_for_a_day(tmp_path: Path) -> None:
    now = time.time()
    assert hang_faults(tmp_path, now) == {}
    note_hang(tmp_path, "editor", Hang(now, 61.0))
    assert "did not answer for 61 s" in hang_faults(tmp_path, now)["editor-hung"]
    assert hang_faults(tmp_path, now + DAY + 1) == {}
    (tmp_path / "hangs.json").write_text("[[[")
    assert hang_faults(tmp_path, now) == {}
