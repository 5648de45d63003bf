"""Old rows of the audit go by whole months: none that is younger, none that an incident needs, and the
log says what went and stays sound."""

import asyncio
from collections.abc import Iterable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from tempfile import TemporaryDirectory

import anyio
import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import insert

from action_assistant.cli import main
from action_assistant.editor.app import open_services
from action_assistant.editor.log import graph_events as h
from action_assistant.editor.people import audit_facts
from action_assistant.errors import Conflict, Unavailable
from action_assistant.journal import heads
from action_assistant.journal.copies.copying import copy
from action_assistant.journal.databases import database_of
from action_assistant.journal.events import Event, nothing
from action_assistant.journal.journal import Journal
from action_assistant.journal.slots import Cursor
from action_assistant.runner.analysis import annotations
from action_assistant.runner.projection import fold as runner_fold
from action_assistant.runner.review.incident import incident_times
from action_assistant.runner.runs.events import Author
from action_assistant.schema.runner_tables import run as runs
from action_assistant.settings import EditorSettings
from action_assistant.web.audit.events import (
    KEEPING,
    STREAM,
    AuditDropped,
    AuditKept,
    SessionEnded,
    draft_of,
    is_of_month,
    stream_at,
)
from action_assistant.web.audit.log import AuditLog
from action_assistant.web.audit.retention import AuditRetention, kept_for_incidents
from action_assistant.web.audit.rows import AuditFilter, AuditPage
from journal.servers import Server
from support.doses import examples

NOW = datetime(2026, 11, 28, 12, tzinfo=UTC)
DAY_US = 86_400_000_000


def us(moment: datetime) -> int:
    return round(moment.timestamp()) * 1_000_000


class Clock:
    """The clock of a process and of its journal."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.now = us(NOW)
        patch.setattr("action_assistant.journal.writer.utc_us", self)

    def __call__(self) -> int:
        return self.now


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """A clock that stands."""
    return Clock(monkeypatch)


@pytest.fixture(params=["sqlite", "postgres"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """A database of each kind, empty."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'editor.db'}"
    server: Server = request.getfixturevalue("postgres")
    return server.new_database()


async def _note(journal: Journal, clock: Clock, moments: Iterable[datetime]) -> None:
    """Store one fact of the audit and one event about a graph at each of these times."""
    for number, moment in enumerate(moments):
        clock.now = us(moment)
        audit = AuditLog(clock)
        async with audit.writing(journal):
            audit.note(SessionEnded(f"s{number}"), "ada")
        await journal.append("about/g", [h.draft(h.DELETED, "ada")])
    clock.now = us(NOW)


def _retention(journal: Journal, days: float | None, clock: Clock) -> AuditRetention:
    return AuditRetention(journal, days, kept_for_incidents, clock_us=clock)


async def _audit(journal: Journal) -> list[Event]:
    return [each for each in await journal.read_all(limit=10_000) if is_of_month(each.stream)]


async def _page(journal: Journal) -> AuditPage:
    return await journal.ask(lambda c: audit_facts.page(AuditFilter(limit=1000), c))


MOMENTS = [datetime(2026, month, day, tzinfo=UTC) for month in (5, 6, 11) for day in (1, 10, 20)]


async def test_old_months_go_the_log_stays_sound_and_says_what_went(url: str, clock: Clock) -> None:
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    await _note(journal, clock, MOMENTS)
    before = await journal.read_all()
    lines = [
        await heads.head_at(journal, "editor", Cursor().after(position), lambda _: [])
        for position in range(1, len(before) + 1)
    ]
    may = await journal.end("audit/2026-05")
    assert await _retention(journal, 170, clock).sweep() == 1  # the 20th of June is 161 days ago
    assert await journal.verify() == []
    left = [each for each in before if each.stream != "audit/2026-05"]
    assert (await journal.read_all())[: len(left)] == left
    (told,) = [each for each in await journal.read(KEEPING) if each.kind == AuditDropped.kind]
    dropped = msgspec.json.decode(told.body, type=AuditDropped)
    first, _, last = map(us, MOMENTS[:3])
    assert dropped == AuditDropped(
        "audit/2026-05", 3, first, last, 3, may.chain.hex(), dropped.by, 170.0
    )
    page = await _page(journal)
    assert page.dropped is not None
    assert (page.dropped.until, page.dropped.days) == (MOMENTS[2], 170.0)
    assert page.rows[0].text == (
        "3 rows of audit/2026-05, from 2026-05-01 00:00 UTC to 2026-05-20 00:00 UTC, were dropped by "
        f"the setting (170 days). Their chain ended at event 3 with {may.chain.hex()}"
    )
    assert sum(each.event == SessionEnded.kind for each in page.rows) == 6
    assert sum(each.event == h.DELETED for each in page.rows) == 9  # a graph's history stays
    # Lines that were kept elsewhere: only those from within the month cannot be compared.
    for position, line in enumerate(lines, 1):
        then = Cursor().after(position)
        if before[0].position <= position < before[4].position:
            with pytest.raises(Conflict, match="audit/2026-05, which went on then, was dropped"):
                await heads.head_at(journal, "editor", then, lambda _: [])
        else:
            assert await heads.head_at(journal, "editor", then, lambda _: []) == line
    await journal.rebuild()
    assert await _retention(journal, 170, clock).sweep() == 0
    clock.now += 400 * DAY_US
    assert await _retention(journal, 170, clock).sweep() == 2
    assert await journal.verify() == []
    assert await _audit(journal) == []
    assert [each.kind for each in await journal.read(KEEPING)] == [AuditDropped.kind] * 3
    await journal.close()


@settings(deadline=None, max_examples=examples(10))
@given(
    ages=st.lists(st.integers(0, 400), max_size=25),
    days=st.integers(0, 400),
    incidents=st.lists(st.tuples(st.integers(0, 400), st.integers(0, 3)), max_size=2),
    older=st.booleans(),
)
async def test_nothing_goes_that_is_younger_or_of_an_incident_or_history(
    ages: list[int], days: int, incidents: list[tuple[int, int]], older: bool
) -> None:
    with TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        clock = Clock(patch)
        url = f"sqlite:///{Path(folder) / 'editor.db'}"
        journal = await Journal.open(url, branch="editor", fold=h.fold)
        try:
            moments = [NOW - timedelta(days=age) for age in sorted(ages, reverse=True)]
            if older and moments:  # a data folder of before there was a stream for each month
                clock.now = us(moments[0])
                await journal.append(STREAM, [draft_of(SessionEnded("old"), "ada")] * 3)
            await _note(journal, clock, moments)
            windows = [
                (clock.now - age * DAY_US, clock.now - (age - length) * DAY_US)
                for age, length in incidents
            ]
            for since, until in windows:
                await journal.append(KEEPING, [draft_of(AuditKept("r", since, until), "ada")])
            before = await journal.read_all(limit=10_000)
            await _retention(journal, days, clock).sweep()
            after = await journal.read_all(limit=10_000)
            assert await journal.verify() == []
            gone = set(before) - set(after)
            assert all(is_of_month(each.stream) for each in gone)
            assert all(each.at < clock.now - days * DAY_US for each in gone)
            assert not any(a <= each.at <= b for each in gone for a, b in windows)
            # A month is there as a whole or not at all.
            assert not {each.stream for each in gone} & {each.stream for each in after}
            whole = {each.stream for each in before if is_of_month(each.stream)}
            for stream in whole - {stream_at(clock.now)}:
                ats = [each.at for each in before if each.stream == stream]
                is_old = max(ats) < clock.now - days * DAY_US
                is_needed = any(a <= max(ats) and min(ats) <= b for a, b in windows)
                assert (stream in {each.stream for each in gone}) == (is_old and not is_needed)
        finally:
            await journal.close()


async def test_a_process_that_ends_while_a_month_goes_leaves_it_gone(
    url: str, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("action_assistant.journal.removal._SLICE", 1)
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    await _note(journal, clock, MOMENTS)
    real, left = Journal.delete_some, [1]

    async def ends(self: Journal, stream: str, by: int) -> bool:
        if not left:
            raise Unavailable("The process has ended.")
        left.pop()
        return await real(self, stream, by)

    monkeypatch.setattr(Journal, "delete_some", ends)
    with pytest.raises(Unavailable):
        await _retention(journal, 170, clock).sweep()
    monkeypatch.setattr(Journal, "delete_some", real)
    assert len(await journal.read("audit/2026-05")) == 2
    assert await journal.verify() == []
    assert sum(each.event == SessionEnded.kind for each in (await _page(journal)).rows) == 6
    # The clock goes back, and a fact comes into that month again: it is not among what goes.
    clock.now = us(MOMENTS[0])
    audit = AuditLog(clock)
    async with audit.writing(journal):
        audit.note(SessionEnded("late"), "ada")
    clock.now = us(NOW)
    await journal.close()
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    assert await _retention(journal, None, clock).sweep() == 0
    (late,) = await journal.read("audit/2026-05")
    assert b'"late"' in late.body
    assert await journal.verify() == []
    assert sum(each.event == SessionEnded.kind for each in (await _page(journal)).rows) == 7
    assert await _retention(journal, 170, clock).sweep() == 1
    assert await journal.read("audit/2026-05") == []
    assert await journal.verify() == []
    await journal.close()


async def test_the_editor_drops_by_its_setting_and_a_copy_of_its_log_is_sound(
    tmp_path: Path, clock: Clock
) -> None:
    url = f"sqlite:///{tmp_path / 'editor.db'}"
    journal = await Journal.open(url, branch="editor", fold=h.fold)
    await _note(journal, clock, MOMENTS)
    await journal.close()
    chosen = EditorSettings(data=tmp_path, database=url, audit_days=170)
    async with open_services(chosen) as services:
        while await services.journal.read("audit/2026-05"):  # noqa: ASYNC110 - nobody tells
            await anyio.sleep(0.01)
        assert await services.journal.read("audit/2026-11") != []
    other = f"sqlite:///{tmp_path / 'copy.db'}"
    await asyncio.to_thread(
        lambda: copy(database_of(url), database_of(other), branch="editor", fold=h.fold)
    )
    copied = await Journal.open(other, branch="editor", fold=h.fold)
    assert await copied.verify() == []
    assert (await _page(copied)).dropped is not None
    await copied.close()


def test_a_kept_export_is_checked_and_backups_have_what_is_left(
    tmp_path: Path, clock: Clock, capsys: pytest.CaptureFixture[str]
) -> None:
    data, to = tmp_path / "data", tmp_path / "back"
    data.mkdir()

    async def fill(*, drop: bool) -> None:
        for branch, fold in (("editor", h.fold), ("runner", nothing)):
            url = f"sqlite:///{data / f'{branch}.db'}"
            journal = await Journal.open(url, branch=branch, fold=fold)  # type: ignore[arg-type]
            if drop:
                assert await _retention(journal, 170, clock).sweep() == 1
            else:
                await _note(journal, clock, MOMENTS)
            await journal.close()

    asyncio.run(fill(drop=False))
    kept, changed = tmp_path / "kept.jsonl", tmp_path / "changed.jsonl"
    place = ["--data", str(data)]
    assert main(["audit", "export", str(kept), *place]) == 0
    asyncio.run(fill(drop=True))
    assert main(["audit", "check", str(kept), *place]) == 0  # also what was dropped since
    lines = kept.read_bytes().splitlines(keepends=True)
    assert len(lines) == 2 * len(MOMENTS)
    for number, line in enumerate(lines):
        changed.write_bytes(
            b"".join([*lines[:number], line.replace(b"ada", b"eve"), *lines[number + 1 :]])
        )
        assert main(["audit", "check", str(changed), *place]) == 1
    changed.write_bytes(b"".join(lines[:2]))  # a part of a month that was dropped
    assert main(["audit", "check", str(changed), *place]) == 1
    capsys.readouterr()
    file = tmp_path / "one.zip"
    assert main(["backup", str(file), "--data", str(data)]) == 0
    assert "missing" not in capsys.readouterr().out
    assert main(["restore", str(file), "--data", str(to)]) == 0
    assert main(["verify", "--data", str(to)]) == 0
    assert main(["rebuild", "--data", str(to)]) == 0


async def test_the_runner_keeps_the_audit_around_the_runs_of_incidents(
    tmp_path: Path, clock: Clock
) -> None:
    url = f"sqlite:///{tmp_path / 'runner.db'}"
    journal = await Journal.open(url, branch="runner", fold=runner_fold)
    await _note(journal, clock, [])
    for name, moment in (("kept", MOMENTS[1]), ("other", MOMENTS[4])):
        values = _run(name, us(moment))
        await journal.derive(lambda c, v=values: c.execute(insert(runs).values(v)))
    kept = annotations.IncidentKept(at=clock.now, author=Author("ada", "Ada"))
    await journal.append(annotations.stream_about("kept"), [annotations.draft(kept)])
    audit = AuditLog(clock)
    for moment in MOMENTS:
        clock.now = us(moment)
        async with audit.writing(journal):
            audit.note(SessionEnded("s"), "ada")
    clock.now = us(NOW)
    assert await AuditRetention(journal, 100, incident_times, clock_us=clock).sweep() == 1
    assert len(await journal.read("audit/2026-05")) == 3
    assert await journal.read("audit/2026-06") == []
    assert await journal.verify() == []
    await journal.close()


def _run(name: str, at: int) -> dict[str, object]:
    """Return a row of the table of runs: each column has a value of its type."""
    values: dict[str, object] = {
        column.name: "x" if column.type.python_type is str else 1
        for column in runs.columns
        if not column.nullable
    }
    return values | {
        "id": name,
        "request_id": name,
        "number": at,
        "requested_at": at,
        "ended_at": at + 60_000_000,
    }
