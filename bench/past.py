"""Looking back: history, moments, blame and the search for a breaking edit, over long logs of one graph."""

import asyncio
import math
import random
import statistics
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from typing import Any, Final, NamedTuple

from pycrdt import Doc, Map
from sqlalchemy import text
from table import Table, seconds

from action_assistant.editor.catalogue.graph_checks import GraphChecks
from action_assistant.editor.catalogue.graph_reader import GraphReader
from action_assistant.editor.history import change_summaries
from action_assistant.editor.history.blame import Blame
from action_assistant.editor.history.change_index import ChangeIndex
from action_assistant.editor.history.course_search import AskingSince, CourseSearch
from action_assistant.editor.history.graph_history import GraphHistory
from action_assistant.editor.log.graph_events import UPDATED, fold, graph_stream
from action_assistant.editor.people.people import People
from action_assistant.editor.rooms.open_rooms import Rooms
from action_assistant.editor.workers import EditorWorkers
from action_assistant.journal.events import Draft
from action_assistant.journal.journal import Journal
from action_assistant.random_ids import random_id

TITLE = "Looking back at a graph: three people edit, 40 changes each in turn; one edit breaks it"
SIZES: Final = ((1_000, 100), (10_000, 300), (100_000, 1_000))  # changes, actions
PEOPLE: Final = ("ada", "mari", "hella")
GRAPH: Final = "g"


def tables() -> Iterator[Table]:
    """One row for each length of the log."""
    rows = [asyncio.run(_measured(changes, actions)) for changes, actions in SIZES]
    head = ["changes (actions)", "index made", "one more", "history of 50", "a moment"]
    head += ["two compared", "500 steps", "who set what", "values of a field", "since when"]
    yield Table(head, rows)


async def _measured(changes: int, actions: int) -> list[str]:
    dice = random.Random(1)
    updates, keys = long_past(dice, changes, actions)

    async def measured(work: Callable[["_Past"], Awaitable[list[float]]]) -> list[float]:
        with tempfile.TemporaryDirectory() as folder:
            url = f"sqlite:///{Path(folder) / 'editor.db'}"
            journal = await Journal.open(url, branch="editor", fold=fold)
            try:
                await store(journal, updates)
                async with EditorWorkers.opened() as workers:
                    return await work(_Past(journal, workers, changes, keys, dice))
            finally:
                await journal.close()

    figures = [*await measured(_asked), *await measured(_searched)]
    return [f"{changes:,} ({actions:,})", *map(seconds, figures)]


class _Past(NamedTuple):
    """A stored log of so many changes; `keys`: of its actions."""

    journal: Journal
    workers: EditorWorkers
    changes: int
    keys: list[str]
    dice: random.Random


async def _asked(past: _Past) -> list[float]:
    """What the index and what is made of it answer."""
    journal, workers, changes, keys, dice = past
    await _spread(journal)
    index = ChangeIndex(journal, workers.graphs)
    history, blame = GraphHistory(index), Blame(index)

    async def moment() -> None:
        await index.value(change_summaries.document_at, GRAPH, dice.randrange(1, changes))

    async def compare() -> None:
        first, last = sorted(dice.sample(range(1, changes), 2))
        await index.text(change_summaries.differing, GRAPH, first, last)

    async def steps() -> None:
        at = dice.randrange(1, changes - 500)
        await blame.changes(GRAPH, at, at + 500, 5000)

    return [
        await _median(lambda: index.upto(GRAPH, changes - 1), 1),
        await _median(lambda: index.upto(GRAPH), 1),
        await _median(lambda: history.of(GRAPH, limit=50, before=None)),
        await _median(moment),
        await _median(compare),
        await _median(steps),
        await _median(lambda: blame.of(GRAPH, keys[0], changes)),
        await _median(lambda: blame.of_field(GRAPH, keys[0], "in/speed", changes)),
    ]


async def _searched(past: _Past) -> list[float]:
    """What enters rooms, which take a log as it was written: the search for an edit."""
    journal, workers, changes, *_ = past
    people, rooms = await People.known(journal), Rooms(journal)
    index = ChangeIndex(journal, workers.graphs)
    reader = GraphReader(journal, rooms, workers.graphs)
    checks = GraphChecks(journal, rooms, reader)
    search = CourseSearch(index, people, checks)

    asked = AskingSince(1, {"behaviours": {}}, changes)
    try:
        await index.upto(GRAPH)
        return [await _median(lambda: search.since(GRAPH, asked), 1)]
    finally:
        await rooms.close()


async def _median(work: Callable[[], Awaitable[Any]], times: int = 7) -> float:
    found: list[float] = []
    for _ in range(times):
        begun = time.perf_counter()
        await work()
        found.append(time.perf_counter() - begun)
    return statistics.median(found)


async def store(journal: Journal, updates: list[bytes], graph: str = GRAPH) -> None:
    """As events of the people in turn."""
    for start in range(0, len(updates), 1000):
        some = enumerate(updates[start : start + 1000], start)
        drafts = [Draft(UPDATED, PEOPLE[(n // 40) % 3], update) for n, update in some]
        await journal.append(graph_stream(graph), drafts)


async def _spread(journal: Journal) -> None:
    """With breaks between the sittings: the journal itself takes the time of now. Rooms take such events
    for damaged, since their times are not those that were written; the index does not ask."""
    spread = text("update event set at = (seq / 40) * 400000000 + seq * 1000000")
    await journal.derive(lambda connection: connection.execute(spread))


def long_past(dice: random.Random, count: int, size: int) -> tuple[list[bytes], list[str]]:
    """A chain that people edit; two thirds of the way somebody cuts it."""
    doc: Doc[Any] = Doc()
    made: list[bytes] = []
    doc.observe(lambda event: made.append(event.update))
    keys = [random_id() for _ in range(size)]
    actions: Map[Any] = doc.get("actions", type=Map)
    positions: Map[Any] = doc.get("positions", type=Map)
    relations: Map[Any] = doc.get("relations", type=Map)
    with doc.transaction():
        relations[f"entry>{keys[0]}|on_true"] = "run"
        for n, key in enumerate(keys):
            actions[key], positions[key] = f"Act{n}", _home(n, size)
            actions[f"{key}|order"] = float(n)
            if n:
                relations[f"{keys[n - 1]}>{key}|on_true"] = "run"
    broken = count * 2 // 3
    while len(made) < count:
        n = dice.randrange(size)
        key, (x, y) = keys[n], _home(n, size)
        for _ in range(dice.randrange(1, 12)):  # one thing is typed or dragged
            if len(made) == broken:
                relations[f"{keys[0]}>{keys[1]}|on_true"] = "ignore"
            match dice.random():
                case kind if kind < 0.7:
                    value = f'{{"pvf_type":"number","pvf_value":{dice.randrange(10**6)}}}'
                    actions[f"{key}|in/speed"] = value
                case kind if kind < 0.9:
                    positions[key] = [x + dice.randrange(50), y + dice.randrange(50)]
                case _:
                    actions[key] = f"Act{dice.randrange(10**6)}"
    return made[:count], keys


def _home(n: int, size: int) -> list[float]:
    """Where the n-th card is tidied to, in a field as wide as it is long."""
    row, column = divmod(n, math.ceil(math.sqrt(size)))
    return [260.0 * column, 190.0 * row]
