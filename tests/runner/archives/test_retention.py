"""Old runs and messages are archived, verified before they are deleted, and can be read as
before."""

import asyncio
import multiprocessing
import os
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import msgspec
import pytest
from sqlalchemy import func, select

from action_assistant.commands.backups.data_folder import archived
from action_assistant.errors import Unavailable
from action_assistant.journal.events import Event
from action_assistant.journal.journal import Journal
from action_assistant.runner.analysis import annotations
from action_assistant.runner.analysis.keyframes import KeyframeStore
from action_assistant.runner.analysis.replay import run_replay
from action_assistant.runner.api.review import _lines
from action_assistant.runner.archives import archive_file
from action_assistant.runner.archives.archive_store import Archived
from action_assistant.runner.archives.raw_messages import RawArchived, raw_of
from action_assistant.runner.links.observations import NodeState
from action_assistant.runner.review.stored_runs import StoredRuns
from action_assistant.runner.robots.recordings import Recording
from action_assistant.runner.runs import queries
from action_assistant.runner.runs.events import (
    Author,
    Ended,
    Led,
    Observed,
    PieceOf,
    Published,
    draft_of,
)
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.schema.runner_tables import run, runner_event
from runner.review.old_runs import (
    DAY_US,
    LENGTHS,
    add_run,
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
from runner.runs.test_runs import REQUESTED

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


# --- led runs -----------------------------------------------------------------------------

PIECES = [f"r4.{number}" for number in range(1, 12)]


async def led(tmp_path: Path) -> tuple[Path, dict[str, list[Event]]]:
    """Return a data folder with an old led run of eleven pieces, and its events by run."""
    data = tmp_path / "led"
    data.mkdir()
    journal = await opened(data)
    await add_run(journal, "r4", 4, 12, ended_at=3 * DAY_US)
    for number, piece in enumerate(PIECES):
        asked = msgspec.structs.replace(
            REQUESTED,
            run=piece,
            engine="David",
            simulated=False,
            piece=PieceOf(run="r4", call=number, node="Go_0"),
        )
        seen = Observed(2_000, (NodeState(2_000, "patrol--Go_0", "Go_0", "RUNNING"),))
        events = (asked, Published(1_100, "life"), seen, Ended(3 * DAY_US, "finished", "on_true"))
        await journal.append(stream_of(piece), [draft_of(each) for each in events])
    known = {each: await journal.read(stream_of(each)) for each in ("r4", *PIECES)}
    await journal.close()
    return data, known


async def test_the_pieces_of_a_conducted_run_are_archived_and_read_back_with_it(
    tmp_path: Path,
) -> None:
    data, known = await led(tmp_path)
    journal = await opened(data)
    shelved = archive_store(journal, data)
    assert await shelved.pieces("r4") == PIECES
    questions = StoredRuns(shelved)
    exported = await questions.export("r4", "mcap")
    assert b"/actions/patrol--Go_0/Go_0" in exported
    assert (await retention(journal, data).sweep(30, None)).runs == 1
    (left,) = await journal.query(
        select(func.count().label("n")).where(runner_event.c.stream.startswith("run/"))
    )
    assert left.n == 0
    for _ in range(2):
        assert await journal.verify() == []
        assert {each: await shelved.read(stream_of(each)) for each in known} == known
        assert await shelved.pieces("r4") == PIECES
        assert await questions.export("r4", "mcap") == exported
        assert (await questions.followed("r4.2", False))[0].end == "finished"
        await journal.rebuild()  # without the events
    files = archived(data / "runner.db")
    assert len(files) == 12
    for place, sha256 in files.items():
        assert archive_file.sha256_of(data / "archive" / place) == sha256
    (data / "archive" / "runs" / "1970-01" / "run-000004-r4.3.jsonl.gz").unlink()
    with pytest.raises(Archived, match=r"run-000004-r4\.3"):
        await archive_store(journal, data).read("run/r4.3")
    await journal.close()


async def test_a_conducted_run_is_archived_with_all_of_its_pieces_or_not_at_all(
    tmp_path: Path,
) -> None:
    data, known = await led(tmp_path)
    with closing(sqlite3.connect(data / "runner.db", isolation_level=None)) as file:
        body = "UPDATE event SET body = x'7b' WHERE stream = 'run/r4.3' AND seq = 3"
        assert file.execute(body).rowcount == 1
    journal = await opened(data)
    open_piece = retention(journal, data, is_open="r4.11".__eq__)
    assert (await open_piece.sweep(30, None)).problems == [
        "Run 4 stays here: One of its actions moves again."
    ]
    (problem,) = (await retention(journal, data).sweep(30, None)).problems
    assert problem.startswith("Run 4 stays here")
    shelved = archive_store(journal, data)
    lengths = {each: len(await journal.read(stream_of(each))) for each in known}
    assert lengths == {each: len(events) for each, events in known.items()}
    assert await shelved.read("run/r4.1") == known["r4.1"]
    await journal.close()


@pytest.mark.parametrize("cleared", [0, 1, 5])
async def test_a_sweep_that_was_interrupted_clears_the_pieces_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, cleared: int
) -> None:
    data, known = await led(tmp_path)
    journal = await opened(data)
    delete_some, calls = Journal.delete_some, iter(range(100))

    async def dies(self: Journal, stream: str, by: int) -> bool:
        if next(calls) >= cleared:
            raise Unavailable("the process ends here")
        return await delete_some(self, stream, by)

    with monkeypatch.context() as patched:
        patched.setattr(Journal, "delete_some", dies)
        await retention(journal, data).sweep(30, None)
    shelved = archive_store(journal, data)
    assert {each: await shelved.read(stream_of(each)) for each in known} == known
    assert (await retention(journal, data).sweep(30, None)).problems == []
    assert (
        await journal.query(select(runner_event).where(queries.streams_of_pieces("r4").exists()))
        == []
    )
    assert await journal.verify() == []
    assert {each: await shelved.read(stream_of(each)) for each in known} == known
    await journal.close()


async def test_the_export_of_a_conducted_run_has_the_events_of_its_pieces(tmp_path: Path) -> None:
    data, known = await led(tmp_path)
    journal = await opened(data)
    questions = StoredRuns(archive_store(journal, data))

    class Here:
        """Answers questions in this process."""

        async def value(self, question: Any, *args: Any) -> Any:
            """Return the answer."""
            return await question(questions, *args)

    async def exported() -> list[Any]:
        seq, page = await questions.lines("r4", 0)
        pages = [each async for each in _lines(Here(), "r4", seq, page)]  # type: ignore[arg-type]
        return [msgspec.json.decode(each) for each in b"".join(pages).splitlines()]

    before = await exported()
    assert [(each["run"], each["seq"]) for each in before] == [
        (run_id, event.seq) for run_id, events in known.items() for event in events
    ]
    await retention(journal, data).sweep(30, None)
    assert await exported() == before
    await journal.close()


def test_the_raw_messages_of_a_conducted_run_are_those_of_all_its_robots() -> None:
    players = {"Go_0": "David", "Wait_0": "Carol"}
    asked = msgspec.structs.replace(
        REQUESTED, engine="conducted", simulated=False, led=Led(robots={}, players=players)
    )
    found = replay([asked, Ended(2_000, "finished", "on_true")])
    assert found is not None
    here = {each: [Recording("1970-01-01T00", 10)] for each in found.robots}
    gone = [RawArchived(3_000, "Carol", "1970-01-01T00", "raw/Carol/x", 10, "")]
    raw = raw_of(found, {"David": here["David"]}, gone, 2_000)
    assert [(each.robot, each.file) for each in raw.hours] == [
        ("Carol", "raw/Carol/x"),
        ("David", None),
    ]
    assert [each.robot for each in raw_of(found, here, [], 2_000).hours] == ["Carol", "David"]
