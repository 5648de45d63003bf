"""The audit stores each fact that it was given, and few rows of a flood."""

import asyncio
import contextlib
import sqlite3
from collections.abc import Sequence
from pathlib import Path

import msgspec
import pytest

from action_assistant.errors import BadInput, Unavailable
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal
from action_assistant.web.audit.events import (
    SessionEnded,
    StartRefused,
    StopPressed,
    StrangersRefused,
    Unlisted,
    is_of_month,
)
from action_assistant.web.audit.log import REPEATED_ROWS, STRANGER_ROWS, AuditLog

MINUTE = 60_000_000
DAY = 24 * 60 * MINUTE
MORNING = 20_000 * DAY + 8 * 60 * MINUTE


class Clock:
    """A clock that goes as the test says."""

    def __init__(self) -> None:
        self.now = MORNING

    def __call__(self) -> int:
        return self.now


class Store:
    """A journal in memory, which may fail."""

    def __init__(self) -> None:
        self.drafts: list[Draft] = []
        self.fails = False

    async def append(self, stream: str, drafts: Sequence[Draft]) -> int:
        assert is_of_month(stream)
        if self.fails:
            raise Unavailable("The disk is full.")
        if any(b'"s77"' in each.body for each in drafts):
            raise BadInput("A name cannot hold the character NUL.")
        self.drafts += drafts
        return len(self.drafts)

    def of(self, kind: str) -> list[Draft]:
        return [each for each in self.drafts if each.kind == kind]


async def test_what_is_noted_before_and_while_it_is_open_is_stored_in_order() -> None:
    audit, store = AuditLog(), Store()
    audit.note(SessionEnded("s1", own=True), "ada")
    async with audit.writing(store):
        audit.note(SessionEnded("s2"), "ben")
    assert [each.author for each in store.drafts] == ["ada", "ben"]


async def test_a_journal_that_fails_gets_everything_later(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("action_assistant.web.audit.log._AGAIN_S", 0.01)
    audit, store = AuditLog(), Store()
    store.fails = True
    async with audit.writing(store):
        for number in range(300):
            audit.note(SessionEnded(f"t{number}"), "ada")
        await asyncio.sleep(0.05)
        assert store.drafts == []
        store.fails = False
    sessions = [msgspec.json.decode(each.body)["session"] for each in store.drafts]
    assert sessions == [f"t{number}" for number in range(300)]


@pytest.mark.parametrize("is_locked", [False, True])
async def test_at_the_end_only_what_the_journal_was_not_given_is_called_lacking(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    is_locked: bool,
) -> None:
    monkeypatch.setattr("action_assistant.web.audit.log._AT_THE_END_S", 0.2)
    monkeypatch.setattr("action_assistant.web.audit.log._BATCH", 20)
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    journal = await Journal.open(url, branch="runner", fold=nothing)
    audit = AuditLog()
    with contextlib.closing(sqlite3.connect(tmp_path / "runner.db", isolation_level=None)) as other:
        async with audit.writing(journal):
            if is_locked:
                other.execute("BEGIN IMMEDIATE")
            for number in range(25):
                audit.note(SessionEnded(f"t{number}"), "ada")
        if is_locked:
            other.execute("ROLLBACK")
        await journal.close()
        stored = other.execute("SELECT count(*) FROM event").fetchone()
    lacking = [each for each in caplog.messages if "lacks" in each]
    assert stored == ((20,) if is_locked else (25,))
    assert lacking == (["the audit lacks its last 5 events"] if is_locked else [])


async def test_an_event_that_cannot_be_stored_holds_up_no_other_one_and_is_counted() -> None:
    audit, store = AuditLog(), Store()
    async with audit.writing(store):
        for number in range(300):
            audit.note(SessionEnded(f"s{number}"), "ada")
    stored = [msgspec.json.decode(each.body)["session"] for each in store.of(SessionEnded.kind)]
    assert stored == [f"s{number}" for number in range(300) if number != 77]
    (lost,) = store.of(Unlisted.kind)
    assert msgspec.json.decode(lost.body, type=Unlisted) == Unlisted("lost", 1)


async def test_what_a_full_disk_holds_up_too_long_is_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("action_assistant.web.audit.log._AGAIN_S", 0.01)
    monkeypatch.setattr("action_assistant.web.audit.log._WAITING", 100)
    audit, store = AuditLog(), Store()
    store.fails = True
    async with audit.writing(store):
        for number in range(150):
            audit.note(SessionEnded(f"t{number}"), "ada")
        await asyncio.sleep(0.05)
        store.fails = False
    assert len(store.of(SessionEnded.kind)) == 100
    (lost,) = store.of(Unlisted.kind)
    assert msgspec.json.decode(lost.body, type=Unlisted) == Unlisted("lost", 50)


async def test_refused_strangers_are_counted_by_address_and_minute() -> None:
    clock = Clock()
    audit, store = AuditLog(clock), Store()
    async with audit.writing(store):
        for second in range(120):
            clock.now = MORNING + second * 1_000_000
            audit.refused_stranger("10.0.0.7", f"GET /api/graphs/{second}")
            if second % 2:
                audit.refused_stranger("10.0.0.8", "POST /api/runs")
    found = [msgspec.json.decode(each.body, type=StrangersRefused) for each in store.drafts]
    assert found == [
        StrangersRefused("10.0.0.7", MORNING, 60, "GET /api/graphs/0"),
        StrangersRefused("10.0.0.7", MORNING + MINUTE, 60, "GET /api/graphs/60"),
        StrangersRefused("10.0.0.8", MORNING, 30, "POST /api/runs"),
        StrangersRefused("10.0.0.8", MORNING + MINUTE, 30, "POST /api/runs"),
    ]
    assert all(not each.author for each in store.drafts)


async def test_a_flood_from_many_addresses_makes_no_more_than_1000_rows_a_day() -> None:
    clock = Clock()
    audit, store = AuditLog(clock), Store()
    async with audit.writing(store):
        for number in range(100_000):
            clock.now = MORNING + number * 300_000  # for eight hours
            audit.refused_stranger(f"10.{number >> 16}.{number >> 8 & 255}.{number & 255}", "GET /")
    rows = store.of(StrangersRefused.kind)
    assert len(store.drafts) <= STRANGER_ROWS
    (unlisted,) = store.of(Unlisted.kind)
    counted = msgspec.json.decode(unlisted.body, type=Unlisted)
    assert len(rows) + counted.count == 100_000


async def test_the_rows_of_a_day_count_also_after_a_restart(tmp_path: Path) -> None:
    journal = await Journal.open(f"sqlite:///{tmp_path / 'log.db'}", branch="runner", fold=nothing)
    for _ in range(3):
        audit = AuditLog()
        async with audit.writing(journal):
            for number in range(600):
                audit.refused_stranger(f"10.0.{number >> 8}.{number & 255}", "GET /")
    events = [each for each in await journal.read_all(limit=9_999) if is_of_month(each.stream)]
    await journal.close()
    assert 900 <= sum(each.kind == StrangersRefused.kind for each in events) <= STRANGER_ROWS
    assert len(events) <= STRANGER_ROWS


async def test_a_new_day_has_its_own_rows() -> None:
    clock = Clock()
    audit, store = AuditLog(clock), Store()
    async with audit.writing(store):
        for day in range(2):
            clock.now = MORNING + day * DAY
            for number in range(2_000):
                audit.refused_stranger(f"10.0.{number >> 8}.{number & 255}", "GET /")
    assert 1_800 <= len(store.of(StrangersRefused.kind)) <= 2 * STRANGER_ROWS


async def test_a_refused_start_is_stored_at_once_and_its_repetitions_together() -> None:
    clock = Clock()
    audit, store = AuditLog(clock), Store()
    refused = StartRefused(what="start", why="It is busy.", engines=("Carrier",))
    async with audit.writing(store):
        for _ in range(1_000):
            audit.note_repeated(refused, "ada")
            audit.note_repeated(StopPressed(), "ben")
        audit.note_repeated(refused, "ben")
        await asyncio.sleep(0.05)
        assert len(store.drafts) == 3
    assert len(store.drafts) == 5
    times = [msgspec.json.decode(each.body).get("times", 1) for each in store.of(StartRefused.kind)]
    assert times == [1, 1, 999]


async def test_refused_starts_that_all_differ_are_bounded_too() -> None:
    audit, store = AuditLog(Clock()), Store()
    async with audit.writing(store):
        for number in range(10_000):
            refused = StartRefused(what="start", why=f"No {number}.")
            audit.note_repeated(refused, "ada")
    assert len(store.drafts) <= REPEATED_ROWS
    (unlisted,) = store.of(Unlisted.kind)
    counted = msgspec.json.decode(unlisted.body, type=Unlisted)
    assert len(store.of(StartRefused.kind)) + counted.count == 10_000


async def test_a_person_who_is_refused_all_day_hides_no_other_person() -> None:
    audit, store = AuditLog(clock := Clock()), Store()
    async with audit.writing(store):
        for day in range(2):
            clock.now = MORNING + day * DAY
            for number in range(5_000):
                refused = StartRefused(what="start", why=f"No {number}.")
                audit.note_repeated(refused, "mallory")
            audit.note_repeated(StopPressed("arm", ""), "ada")
            audit.note_repeated(StartRefused(what="start", why="The robot is lost."), "ben")
    theirs = [each.author for each in store.drafts if each.author in {"ada", "ben"}]
    assert sorted(theirs) == ["ada", "ada", "ben", "ben"]
