"""Runs looked back on: lists of many, runs of many events, and what all of it takes on the disk."""

import asyncio
import contextlib
import itertools
import statistics
import sys
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

import anyio
import msgspec
from sqlalchemy import NullPool, create_engine, insert, select
from table import Table, seconds

from action_assistant.errors import NotFound
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.runner.analysis import statistics as sums
from action_assistant.runner.analysis.keyframes import APART, KeyframeStore
from action_assistant.runner.analysis.replay import run_replay
from action_assistant.runner.archives import archive_file
from action_assistant.runner.links.observations import NodeResult, NodeState
from action_assistant.runner.review.background_loops import due_after
from action_assistant.runner.review.stored_runs import StoredRuns, numbers_with
from action_assistant.runner.review.worker_queries import StoragePaths, WorkerQueries
from action_assistant.runner.robots.recordings import Recordings
from action_assistant.runner.runs import queries, views
from action_assistant.runner.runs.events import (
    Author,
    Ended,
    Observed,
    Published,
    Requested,
    draft_of,
)
from action_assistant.runner.runs.fold import replay
from action_assistant.runner.runs.recorder import stream_of
from action_assistant.runner.runs.sent_graphs import Sent
from action_assistant.runner.runs.word_index import index_some
from action_assistant.runner.workers import RunnerWorkers
from action_assistant.schema.runner_tables import action_sum, review, run_label, unindexed_run
from action_assistant.schema.runner_tables import run as runs
from action_assistant.web.workers.lanes import RunInWorker

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from action_assistant.runner import projection
from runner.harness import at_once, run_in_virtual_time, sequence
from runner.record_streams import Place

TITLE = "Lists of runs, runs of many events, and the room that they take"
SIZES: Final = (1_000, 10_000, 100_000)
TIMES: Final = 5
_GRAPHS: Final = 20
_ANN: Final = Author("ann", "Ann")
_ASIDE: Final[RunInWorker] = anyio.to_thread.run_sync


def tables() -> Iterator[Table]:
    """Lists; one run; room."""
    with tempfile.TemporaryDirectory() as folder:
        yield asyncio.run(_lists(Path(folder)))
    with tempfile.TemporaryDirectory() as folder:
        yield asyncio.run(_long_runs(Path(folder)))
    yield _room()


# --- lists ------------------------------------------------------------------------------------


async def _lists(folder: Path) -> Table:
    journal = await _opened(folder)
    rows: list[list[str]] = []
    there = 0
    for size in SIZES:
        await _ASIDE(partial(_add_runs, folder / "runner.db", there, size))
        there = size
        (middle,) = await journal.query(select(runs.c.id).where(runs.c.number == size // 2))
        rows.append([f"{size:,}", *[await _took(ask) for ask in _questions(journal, middle.id)]])
    await journal.close()
    head = ("newest 200", "200 from the middle", "of one graph", "failed", "label")
    words = ("a word that is nowhere", "rare words", "a word of all")
    return Table(["runs", *head, *words, "statistics of a graph"], rows)


def _questions(journal: Journal, middle: str) -> list[Callable[[], Awaitable[Any]]]:
    def page(**wanted: Any) -> Callable[[], Awaitable[Any]]:
        async def ask() -> None:
            text = wanted.get("text")
            among = None if text is None else await numbers_with(text, journal.query)
            rows = await journal.query(queries.listed(queries.Filter(**wanted), 200, among))
            await journal.query(queries.labels_of([row.id for row in rows]))
            msgspec.json.encode([views.list_entry(views.summary_of_row(r), r, []) for r in rows])

        return ask

    async def summed() -> None:
        rows = await journal.query(sums.runs_of("g7", None, 200))
        sums.statistics(rows, await journal.query(sums.sums_of([row.id for row in rows])), None)

    pages = ({}, {"before": middle}, {"graph": "g7"}, {"failed": True}, {"label": "demo"})
    words = [page(text=text) for text in ("nowhere", "needle 7 ", "needle")]
    return [*(page(**wanted) for wanted in pages), *words, summed]


def _add_runs(path: Path, after: int, upto: int) -> None:
    """As rows of the tables, which are all that a list looks at."""
    engine = create_engine(f"sqlite:///{path}", poolclass=NullPool)
    with engine.begin() as connection:
        for first in range(after + 1, upto + 1, 1_000):
            numbers = range(first, min(first + 1_000, upto + 1))
            connection.execute(insert(runs), [_row(number) for number in numbers])
            connection.execute(insert(review), [_noted(number) for number in numbers])
            connection.execute(insert(action_sum), [each for n in numbers for each in _sums(n)])
            labels = [{"run": f"run-{n}", "label": "demo"} for n in numbers if n % 50 == 0]
            connection.execute(insert(run_label), labels)
            connection.execute(insert(unindexed_run), [{"number": number} for number in numbers])
            while index_some(connection, 1_000):
                pass
    engine.dispose()


def _row(number: int) -> dict[str, Any]:
    asked = _asked(number)
    return {
        "id": asked.run,
        "number": number,
        "graph": asked.graph,
        "graph_name": asked.graph_name,
        "version": asked.version,
        "digest": asked.digest,
        "engine": asked.engine,
        "author_id": asked.author.id,
        "author_name": asked.author.name,
        "state": ("finished", "error", "stopped")[number % 3 if number % 500 == 0 else 0],
        "desired": "running",
        "simulated": False,
        "request_id": asked.request_id,
        "requested_at": asked.at,
        "started_at": asked.at,
        "ended_at": asked.at + 9_000_000,
        "result": "on_true",
        "summary": {"alarms": []},
    }


def _noted(number: int) -> dict[str, Any]:
    words = f"needle {number} in a stack of words that nobody ever looks for twice"
    return {
        "run": f"run-{number}",
        "pinned": False,
        "note": "",
        "words": words,
        "summed": True,
    }


def _sums(number: int) -> list[dict[str, Any]]:
    fields = {"visits": 1, "results": {"true": 1}, "inferred": 0, "took": [2_000_000]}
    return [
        {"run": f"run-{number}", "action": f"Work_{i}", "aid": f"a{i}", **fields} for i in range(3)
    ]


def _asked(number: int) -> Requested:
    name = f"g{number % _GRAPHS}"
    return Requested(
        at=1_800_000_000_000_000 + number * 60_000_000,
        run=f"run-{number}",
        number=number,
        request_id=f"q{number}",
        author=_ANN,
        graph=name,
        graph_name=name,
        version="v1",
        digest=f"{number % 97:064x}",
        engine=f"Robot{number % 7}",
        simulated=False,
        actions={f"Work_{i}": f"a{i}" for i in range(12)},
        umrf="{}",
    )


# --- one run ----------------------------------------------------------------------------------


async def _long_runs(folder: Path) -> Table:
    async with (
        RunnerWorkers.opened() as workers,
        anyio.create_task_group() as tasks,
    ):
        journal = await _opened(folder)
        place = StoragePaths(folder / "runner.db", folder / "archive")
        asked = WorkerQueries(workers.looks, place, journal, tasks)
        table = await _long_runs_with(journal, asked)
        await journal.close()
    return table


async def _long_runs_with(journal: Journal, asked: WorkerQueries) -> Table:
    rows: list[list[str]] = []
    for number, size in enumerate(SIZES, 1):
        events = _long_run(number, size)
        run, drafts = f"run-{number}", _drafts(events)
        for i in range(0, size, 5_000):
            await journal.append(stream_of(run), drafts[i : i + 5_000])
        started = time.perf_counter()
        told = replay(events)
        folded = time.perf_counter() - started
        assert told is not None
        died = await _after_a_death(journal, _long_run(number + len(SIZES), size)[:-1])
        rows.append(
            [f"{size:,}", seconds(folded), *await _opening(journal, asked, run, size), died]
        )
    head = ("folded in memory", "opened the first time", "opened", "first page of its film")
    head = (*head, "a page in the middle", "any moment", "opened when the runner has died")
    return Table(["events", *head], rows)


async def _after_a_death(journal: Journal, events: list[Any]) -> str:
    """With as much left to fold as there may be: keyframes were kept while it went on."""
    run, drafts, kept = events[0].run, _drafts(events), 0
    while due_after(kept) * APART <= len(drafts):
        kept = due_after(kept)
    stream, upto = stream_of(run), kept * APART
    for i in range(0, upto, APART):
        await journal.append(stream, drafts[i : i + APART])
    if upto:
        await KeyframeStore(journal).keyframes(run)
    for i in range(upto, len(drafts), APART):
        await journal.append(stream, drafts[i : i + APART])
    started = time.perf_counter()
    key = (await KeyframeStore(journal).keyframes(run)).keys[-1]
    msgspec.json.encode(views.whole_view(key.run, Sent("{}", {})))
    return seconds(time.perf_counter() - started)


async def _opening(journal: Journal, asked: WorkerQueries, run: str, size: int) -> list[str]:
    """The first time keyframes are made, by a worker, and stored when whoever asked has the answer;
    after that they are in the journal."""

    async def opened(keyframe_store: KeyframeStore) -> None:
        key = (await keyframe_store.keyframes(run)).keys[-1]
        msgspec.json.encode(views.whole_view(key.run, Sent("{}", {})))

    with contextlib.suppress(NotFound):
        await asked.text(StoredRuns.whole, "none")  # the worker is there
    started = time.perf_counter()
    await asked.text(StoredRuns.whole, run)
    first = seconds(time.perf_counter() - started)
    while await journal.snapshot(stream_of(run)) is None:  # noqa: ASYNC110 in another process
        await anyio.sleep(0.01)
    known = KeyframeStore(journal)
    middle = size // 2 - size // 2 % APART

    async def page(after: int) -> None:
        msgspec.json.encode(await run_replay(known, run, after=after))

    return [
        first,
        await _took(lambda: opened(KeyframeStore(journal))),  # as another process would
        await _took(lambda: page(0)),
        await _took(lambda: page(middle)),
        await _took(lambda: known.at(run, size // 3 + 1)),
    ]


def _long_run(number: int, size: int) -> list[Any]:
    """Twelve actions take turns, each with a state or a result per event."""
    asked = _asked(number)
    events: list[Any] = [asked, Published(asked.at, "life")]
    names = itertools.cycle(asked.actions)
    at = asked.at
    while len(events) < size - 1:
        name = next(names)
        for what in ("RUNNING", "on_true", "FINISHED"):
            at += 100_000
            seen = (
                NodeResult(at, asked.graph_name, name, what, "done")
                if what == "on_true"
                else NodeState(at, asked.graph_name, name, what)
            )
            events.append(Observed(at, (seen,)))
    return [*events[: size - 1], Ended(at, "finished", "on_true")]


# --- room -------------------------------------------------------------------------------------


def _room() -> Table:
    rows = [_measured(actions, took) for actions, took in ((10, 360.0), (100, 36.0), (1_000, 0.36))]
    head = ["events", "sent by the engine", "journal", "raw messages, gzipped", "archive"]
    return Table(["a run", *head], rows)


class RunSizes(NamedTuple):
    """The size of one run: its events, and the bytes of what holds them."""

    events: int
    sent: int  # by the engine
    journal: int
    raw: int  # raw messages, gzipped
    archive: int


def _measured(actions: int, took: float) -> list[str]:
    sizes = sizes_of_a_run(actions, took)
    return [
        f"{actions:,} actions of {took:g} s",
        f"{sizes.events:,}",
        *(_size(each) for each in sizes[1:]),
    ]


def sizes_of_a_run(actions: int, took: float) -> RunSizes:
    """Measure a run of so many actions, one after the other, in virtual time. `took`: the seconds of
    each action."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        place, sent = run_in_virtual_time(lambda: _lived(folder, actions, took))
        (events,) = (v for k, v in place.harness.journal.streams.items() if k.startswith("run/"))
        journal = asyncio.run(_stored(folder, events))
        raw = sum(path.stat().st_size for path in folder.glob("recordings/*/*"))
        archived = (folder / "one.jsonl.gz").stat().st_size
    return RunSizes(len(events), sent, journal, raw, archived)


async def _lived(folder: Path, actions: int, took: float) -> tuple[Place, int]:
    place = Place({"*": [{"after_s": took, "message": "done"}]})
    recordings = Recordings(folder / "recordings", at_once)
    link: Any = place.harness.links["Robin"]
    sent = 0
    asked = link.get

    async def get() -> Any:
        nonlocal sent
        answer = await asked()
        sent += sum(map(len, answer.texts.values()))
        recordings.record_answer("Robin", answer)
        return answer

    def hear(report: Any) -> None:
        if hasattr(report, "snapshots"):
            recordings.record_feedback("Robin", report)

    link.get = get
    async with place.network.running() as tasks:
        tasks.start_soon(recordings.run)
        place.robot("Robin")
        await anyio.sleep(0.5)
        async with place.harness.runner() as place.control:
            await anyio.sleep(1.5)
            with link.listen(hear):
                await place.start(sequence("hour", actions))
                while place.control.open:  # noqa: ASYNC110 - an hour, in virtual time
                    await anyio.sleep(5)
        await anyio.sleep(3)
    return place, sent


async def _stored(folder: Path, events: Sequence[Any]) -> int:
    """Bytes in the database, and an archive of the run."""
    journal = await _opened(folder)
    empty = (folder / "runner.db").stat().st_size
    drafts = [Draft(each.kind, each.author, each.body) for each in events]
    for i in range(0, len(drafts), 500):
        await journal.append(events[0].stream, drafts[i : i + 500])
    end, stored = await journal.end(events[0].stream), await journal.read(events[0].stream)
    file = archive_file.ArchiveFile(folder / "one.jsonl.gz", events[0].stream, "one", end)
    file.add(stored)
    file.close()
    await journal.close()
    return (folder / "runner.db").stat().st_size - empty


def _size(number: int) -> str:
    return f"{number / 1e6:.1f} MB" if number >= 1e6 else f"{number / 1e3:.0f} kB"


# --- all --------------------------------------------------------------------------------------


async def _opened(folder: Path) -> Journal:
    return await Journal.open(
        f"sqlite:///{folder / 'runner.db'}", branch="runner", fold=projection.fold
    )


def _drafts(events: Sequence[Any]) -> tuple[Draft, ...]:
    return tuple(draft_of(each, "ann") for each in events)


async def _took(work: Callable[[], Awaitable[Any]]) -> str:
    """The median of some times, after one that is not counted."""
    taken: list[float] = []
    for _ in range(TIMES + 1):
        started = time.perf_counter()
        await work()
        taken.append(time.perf_counter() - started)
    return seconds(statistics.median(taken[1:]))
