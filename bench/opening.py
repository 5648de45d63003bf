"""Opening graphs of many changes without a snapshot, as after a restart that found none."""

import asyncio
import random
import statistics
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from typing import Any, Final

from pycrdt import Doc, Map
from table import Table, seconds

from action_assistant.editor.crdt.loading import LogTail, fold_sound, load
from action_assistant.editor.log.graph_events import UPDATED
from action_assistant.editor.workers import EditorWorkers
from action_assistant.journal.events import Draft, nothing
from action_assistant.journal.journal import Journal

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from journal import servers

TITLE = "A graph of many changes, opened without a snapshot"
SIZES: Final = (10_000, 100_000)
PEOPLE: Final = 5
KEYS: Final = 1_000
TIMES: Final = 5


def tables() -> Iterator[Table]:
    """One row for each database and number of changes."""
    head = ["database", "changes", "opened", "shortest", "CPU of the editor", "of its worker"]
    rows: list[list[str]] = []
    with tempfile.TemporaryDirectory() as folder, ExitStack() as running:
        urls = {"SQLite": f"sqlite:///{Path(folder) / 'editor.db'}"}
        if servers.binaries() is not None:
            urls["Postgres"] = running.enter_context(servers.server()).new_database()
        for size in SIZES:
            drafts = changes(size)
            for name, url in urls.items():
                stream = f"graph/{size}"
                asyncio.run(_fill(url, stream, drafts))
                rows.append([name, f"{size:,}", *asyncio.run(_opened(url, stream))])
    yield Table(head, rows)


def changes(count: int) -> list[Draft]:
    """People who hear of each other at once and change values of a thousand things, one in an update."""
    chance = random.Random(1)
    docs = [Doc[Any]() for _ in range(PEOPLE)]
    maps = [doc.get("things", type=Map) for doc in docs]
    made: list[bytes] = []
    for doc in docs:
        doc.observe(lambda event: made.append(event.update))
    drafts: list[Draft] = []
    while len(drafts) < count:
        who = chance.randrange(PEOPLE)
        made.clear()
        maps[who][f"thing {chance.randrange(KEYS)}"] = chance.random() * 1000
        update = made[0]
        drafts.append(Draft(UPDATED, f"person {who}", update))
        for doc in docs:
            if doc is not docs[who]:
                doc.apply_update(update)
    return drafts


async def _fill(url: str, stream: str, drafts: list[Draft]) -> None:
    async with _journal(url) as journal:
        for start in range(0, len(drafts), 5_000):
            await journal.append(stream, drafts[start : start + 5_000])


async def _opened(url: str, stream: str) -> list[str]:
    """Medians, and the shortest time: what other work on the machine adds is not ours."""
    times: list[float] = []
    own: list[float] = []
    workers_: list[float] = []
    async with _journal(url) as journal, EditorWorkers.opened() as workers:
        for _ in range(TIMES + 1):
            started, spent = time.perf_counter(), time.process_time()
            loaded = await load(journal, stream, run_in_worker=workers.graphs)
            times.append(time.perf_counter() - started)
            own.append(time.process_time() - spent)
            assert loaded.damaged is None
            workers_.append(await _folded(journal, stream))
    opened, spent, folded = (statistics.median(each[1:]) for each in (times, own, workers_))
    return [seconds(each) for each in (opened, min(times[1:]), spent, folded)]


async def _folded(journal: Journal, stream: str) -> float:
    """Processor time of what a worker does, done here."""
    events = await LogTail(journal, stream, 0, None).next()
    assert events is not None
    spent = time.process_time()
    assert fold_sound(b"", events) is not None
    return time.process_time() - spent


@asynccontextmanager
async def _journal(url: str) -> AsyncIterator[Journal]:
    journal = await Journal.open(url, branch="editor", fold=nothing)
    try:
        yield journal
    finally:
        await journal.close()
