"""Old runs and messages are archived, verified before they are deleted, and can be read as
before."""

import asyncio
import multiprocessing
import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import select

from action_assistant.journal.events import Event
from action_assistant.runner.analysis import annotations
from action_assistant.runner.analysis.keyframes import KeyframeStore
from action_assistant.runner.analysis.replay import run_replay
from action_assistant.runner.archives import archive_file
from action_assistant.runner.archives.archive_store import Archived
from action_assistant.runner.runs.events import Author
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.schema.runner_tables import run
from runner.review.old_runs import (
    LENGTHS,
    archive_store,
    copies,
    everything,
    filled,
    opened,
    put_away,
    raw_messages,
    retention,
    waited,
)

#: A process is killed at each such step of a sweep.
EVERY = int(os.environ.get("SOAK_ARCHIVE_EVERY", "13"))


@pytest.fixture(scope="module")
def old(tmp_path_factory: pytest.TempPathFactory) -> Path:
    data = tmp_path_factory.mktemp("old")
    asyncio.run(filled(data))
    return data


@pytest.fixture
def data(old: Path, tmp_path: Path) -> Path:
    """A data folder with three old runs."""
    return next(copies(old, tmp_path))


async def test_an_archived_run_looks_as_it_did(data: Path) -> None:
    journal = await opened(data)
    before = await everything(journal, data)
    shelved = archive_store(journal, data)
    film_before = await run_replay(KeyframeStore(shelved), "r2", after=2_000)
    rows = await journal.query(select(run.c.id, run.c.summary, run.c.state, run.c.result))
    swept = await retention(journal, data).sweep(30, None)
    assert (swept.runs, swept.more, swept.problems) == (3, False, [])
    assert await journal.read("run/r2") == []
    assert [await shelved.read(stream_of(each)) for each in LENGTHS] == list(before.values())
    assert await shelved.read("run/r2", after=10, limit=3) == before["r2"][10:13]
    assert await shelved.read("run/r2", after=10, upto=11) == before["r2"][10:11]
    assert await run_replay(KeyframeStore(shelved), "r2", after=2_000) == film_before
    assert (await retention(journal, data).sweep(30, None)).runs == 0
    for _ in range(2):
        again = select(run.c.id, run.c.summary, run.c.state, run.c.result).order_by(run.c.number)
        assert await journal.query(again) == rows
        (place,) = await journal.query(select(run.c.archived_as).where(run.c.id == "r2"))
        assert place.archived_as == "runs/1970-01/run-000002-r2.jsonl.gz"
        await journal.rebuild()  # without the events
    assert await journal.verify() == []
    await journal.close()


async def test_pinned_and_young_and_open_runs_stay(data: Path) -> None:
    journal = await opened(data)
    marked = annotations.Marked(1, Author("ann", "Ann"), annotations.Marks(pinned=True))
    await journal.append(annotations.stream_about("r1"), [annotations.draft(marked)])
    only = retention(journal, data, is_open=lambda each: each == "r2")
    assert (await only.sweep(98, None)).runs == 0
    assert (await only.sweep(30, None)).runs == 1
    assert [len(await journal.read(stream_of(each))) for each in LENGTHS] == [12, 2_300, 0]
    await journal.close()


async def test_an_archive_that_is_gone_or_damaged_is_named(data: Path) -> None:
    journal = await opened(data)
    await retention(journal, data).sweep(30, None)
    path = data / "archive" / "runs" / "1970-01" / "run-000001-r1.jsonl.gz"
    moved = path.rename(data / "moved.gz")
    with pytest.raises(Archived, match=r"archived on 1970-04-11 as runs/.*runs restore"):
        await archive_store(journal, data).read("run/r1")
    whole = moved.read_bytes()
    path.write_bytes(whole[:200] + b"?" + whole[201:])
    with pytest.raises(archive_file.Damaged):
        await archive_store(journal, data).read("run/r1")
    shutil.copy(path.parent / "run-000003-r3.jsonl.gz", path)
    with pytest.raises(archive_file.Damaged):
        await archive_store(journal, data).read("run/r1")
    path.write_bytes(whole)
    assert len(await archive_store(journal, data).read("run/r1")) == 12
    await journal.close()


async def test_a_run_that_cannot_be_archived_stays_and_is_reported(data: Path) -> None:
    (data / "archive").mkdir()
    (data / "archive" / "runs").write_text("in the way")
    (data / "archive" / "raw").write_text("in the way")
    journal = await opened(data)
    before = await everything(journal, data)
    swept = await retention(journal, data).sweep(30, 7)
    assert (swept.runs, swept.raw, len(swept.problems)) == (0, 0, 5)
    assert await everything(journal, data) == before
    assert len(raw_messages(data)) == 3
    await journal.close()


@pytest.mark.parametrize(
    "harm",
    [
        "DELETE FROM event WHERE stream = 'run/r3' AND seq = 1",
        "UPDATE event SET author = 'eve' WHERE stream = 'run/r3' AND seq = 5",
        "UPDATE event SET body = x'7b' WHERE stream = 'run/r3' AND seq = 12",
    ],
)
async def test_a_damaged_run_is_not_put_away(data: Path, harm: str) -> None:
    with closing(sqlite3.connect(data / "runner.db", isolation_level=None)) as file:
        assert file.execute(harm).rowcount == 1
        left = file.execute("SELECT count(*) FROM event WHERE stream = 'run/r3'").fetchone()
    journal = await opened(data)
    swept = await retention(journal, data).sweep(30, None)
    assert swept.runs == 2
    assert "Run 3 stays here" in swept.problems[0]
    assert not list((data / "archive").glob("**/*r3*"))
    await journal.close()
    with closing(sqlite3.connect(data / "runner.db")) as file:
        assert file.execute("SELECT count(*) FROM event WHERE stream = 'run/r3'").fetchone() == left


async def test_raw_messages_go_sooner_and_it_is_said_where_they_are(data: Path) -> None:
    journal = await opened(data)
    swept = await retention(journal, data).sweep(None, 7)
    assert (swept.runs, swept.raw) == (0, 2)
    assert [path.name for path in (data / "recordings" / "David").iterdir()] == [
        "1970-04-10T23.jsonl.gz"
    ]
    assert raw_messages(data) == {"1970-03-01T07", "1970-03-01T08", "1970-04-10T23"}
    told = await journal.read("raw/David")
    assert [event.kind for event in told] == ["raw.archived.v1"] * 2
    await journal.close()


def test_a_kill_at_any_step_leaves_every_event_in_the_log_or_in_a_whole_archive(
    old: Path, tmp_path: Path
) -> None:
    before, raw = asyncio.run(told(old)), raw_messages(old)
    fork = multiprocessing.get_context("forkserver")
    fork.set_forkserver_preload(["runner.review.old_runs"])
    point, ends = 1, []
    for data in copies(old, tmp_path):
        process = fork.Process(target=put_away, args=(data, point))
        process.start()
        ends.append(waited(process))
        assert raw_messages(data) == raw, f"killed at step {point}"
        assert asyncio.run(told_and_finished(data)) == (before, before), f"killed at step {point}"
        assert not list(data.glob("**/*.part"))
        shutil.rmtree(data)
        if ends[-1] == 0:
            break
        point += EVERY
    assert set(ends[:-1]) == {-9}
    assert len(ends) > 40 // EVERY


async def told(data: Path) -> dict[str, list[Event]]:
    """Return the events of all runs."""
    journal = await opened(data)
    try:
        return await everything(journal, data)
    finally:
        await journal.close()


async def told_and_finished(data: Path) -> tuple[dict[str, list[Event]], dict[str, list[Event]]]:
    """Return the events of all runs now, and after the next process has archived all old runs."""
    journal = await opened(data)
    try:
        now = await everything(journal, data)
        assert (await retention(journal, data).sweep(30, 7)).problems == []
        assert await journal.read("run/r2") == []
        return now, await everything(journal, data)
    finally:
        await journal.close()
