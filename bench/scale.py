"""Simulates days of a large lab, and measures what their edits and runs cost."""

import asyncio
import bisect
import contextlib
import heapq
import itertools
import random
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import ExitStack, asynccontextmanager
from pathlib import Path
from typing import Final, NamedTuple

import msgspec
import opening
import psutil
import runs
from table import Table, seconds

from action_assistant.editor.log import graph_events
from action_assistant.journal.events import Addition, Draft
from action_assistant.journal.journal import Journal

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from editor.catalogue.test_graph_pages import ANN, PAGES, Wanted, seed
from editor.catalogue.test_graph_pages import Database as GraphList
from journal import servers

TITLE = "A lab of 10,000 graphs, 5,000 people and 200 robots, for five years"
GRAPHS: Final = 10_000
PEOPLE: Final = 5_000
ROBOTS: Final = 200
YEARS: Final = 5
WORKDAYS: Final = 250  # in a year
EDITS_A_DAY: Final = 200  # of each person who comes
RUNS_A_DAY: Final = 20  # of each robot
COMES: Final = 0.6  # the share of the people who come on one day
MEASURED: Final = 20_000  # edits
_HOUR: Final = 3600.0
_OPEN: Final = 20  # graphs that the measured edits go to
_WINDOW: Final = 50  # edits in a commit, as in a window of a busy editor


class Peaks(NamedTuple):
    """The largest numbers of one simulated day."""

    people: int  # with a graph open
    graphs: int  # open
    edits: int  # in one second
    deliveries: int  # in one second: each edit goes to all others who have its graph open
    runs: int  # under way


def tables() -> Iterator[Table]:
    """Demands of simulated days; what is measured of one edit; what five years of both come to."""
    days = [simulated(random.Random(seed)) for seed in range(5)]
    head = ["five simulated days", "least", "most"]
    names = ("people at once", "graphs open", "edits in a second", "deliveries in a second")
    yield Table(
        head,
        [
            [name, f"{min(values):,}", f"{max(values):,}"]
            for name, values in zip(
                (*names, "runs under way"), zip(*days, strict=True), strict=True
            )
        ],
    )
    yield asyncio.run(_lists())
    costs = [*measured()]
    yield Table(
        ["database", "bytes an edit", "stored in a second of CPU", "verified in a second of CPU"],
        [
            [each.name, f"{each.size:.0f}", f"{each.stored:,.0f}", f"{each.verified:,.0f}"]
            for each in costs
        ],
    )
    run = runs.sizes_of_a_run(25, 24.0)
    edits = int(PEOPLE * COMES) * EDITS_A_DAY * WORKDAYS
    yearly = ROBOTS * RUNS_A_DAY * WORKDAYS
    rows = [
        [
            f"{years} year{'s' * (years > 1)}, {each.name}",
            f"{edits * years / 1e6:,.0f} million",
            f"{edits * years * each.size / 1e9:,.0f} GB",
            _duration(edits * years / each.verified),
            f"{yearly * years:,}",
            f"{yearly * years * run.archive / 1e9:,.1f} GB",
            f"{yearly * years * run.raw / 1e9:,.0f} GB",
        ]
        for years in (1, YEARS)
        for each in costs
    ]
    head = ["after", "edits", "their log", "verified in", "runs", "archived", "raw messages"]
    yield Table(head, rows)


def simulated(chance: random.Random) -> Peaks:
    """Simulate one working day, and return its peaks.

    People come at eight to ten and stay for eight hours. Each has a few graphs, some of which many
    share, and edits them in bursts of some seconds between pauses. Each robot runs its task again and
    again with pauses.
    """
    popular = list(itertools.accumulate(1 / (rank + 10) for rank in range(GRAPHS)))
    edits: list[tuple[float, int]] = []
    opens: list[tuple[float, int, int]] = []  # when, graph, one more or one less
    for _ in range(int(PEOPLE * COMES)):
        came = chance.gauss(9 * _HOUR, 0.5 * _HOUR)
        mine = [_drawn(popular, chance) for _ in range(chance.randint(1, 4))]
        at, left = came, EDITS_A_DAY
        while at < came + 8 * _HOUR and left > 0:
            graph = chance.choice(mine)
            began = at
            for _ in range(min(left, chance.randint(1, 30))):
                edits.append((at, graph))
                at += chance.expovariate(1 / 2.0)  # seconds between the edits of a burst
                left -= 1
            read = chance.expovariate(1 / 600.0)  # seconds for which the graph stays open
            opens += [(began, graph, 1), (at + read, graph, -1)]
            at += read + chance.expovariate(1 / 900.0)
    return Peaks(*_peaks(edits, opens), _runs_at_once(chance))


def _drawn(cumulated: Sequence[float], chance: random.Random) -> int:
    return bisect.bisect(cumulated, chance.random() * cumulated[-1])


def _peaks(
    edits: list[tuple[float, int]], opens: list[tuple[float, int, int]]
) -> tuple[int, int, int, int]:
    """Return the most people, open graphs, edits and deliveries of a second."""
    here: dict[int, int] = {}
    people = most_people = most_graphs = 0
    each_second: dict[int, int] = {}
    delivered: dict[int, int] = {}
    happened = heapq.merge(
        ((at, 0, graph, change) for at, graph, change in sorted(opens)),
        ((at, 1, graph, 0) for at, graph in sorted(edits)),
    )
    for at, kind, graph, change in happened:
        if kind == 0:
            people += change
            here[graph] = here.get(graph, 0) + change
            if here[graph] == 0:
                del here[graph]
            most_people, most_graphs = max(most_people, people), max(most_graphs, len(here))
        else:
            second = int(at)
            each_second[second] = each_second.get(second, 0) + 1
            delivered[second] = delivered.get(second, 0) + here.get(graph, 1) - 1
    return most_people, most_graphs, max(each_second.values()), max(delivered.values())


def _runs_at_once(chance: random.Random) -> int:
    """Return how many runs are under way at most. Each robot does its runs within ten hours."""
    changes: list[tuple[float, int]] = []
    for _ in range(ROBOTS):
        at = 0.0
        for _ in range(RUNS_A_DAY):
            at += chance.expovariate(1 / 1200.0)
            took = chance.expovariate(1 / 600.0)
            changes += [(at, 1), (at + took, -1)]
            at += took
    return max(itertools.accumulate(change for _, change in sorted(changes)))


async def _lists() -> Table:
    """Measure pages of the list of graphs right after a restart: the slowest kind of page."""
    rows = []
    with tempfile.TemporaryDirectory() as folder, ExitStack() as running:
        places: dict[str, tuple[str, servers.Server | None]] = {
            "SQLite": (f"sqlite:///{folder}/editor.db", None)
        }
        if servers.binaries() is not None:
            server = running.enter_context(servers.server())
            places["Postgres"] = server.new_database(), server
        for name, (url, at) in places.items():
            times = await _page_times(GraphList(url, Path(folder)), at)
            rows.append([f"{GRAPHS:,} graphs, {name}", *times])
    names = [next(iter(each.values()), "newest") for each in PAGES]
    head = [str((getattr(each, "search", "") and "a search") or each) for each in names]
    return Table(["a page of the list", *head[:-1], "a label"], rows)


async def _page_times(place: GraphList, server: servers.Server | None) -> list[str]:
    async with place.opened() as services:
        await seed(services, GRAPHS)
    async with place.opened() as services:
        await services.checks.names.refresh()
        found = []
        for asked in PAGES:
            began = _used(server)
            await services.pages.page(ANN, **{"wanted": Wanted(), "limit": 60, **asked})
            found.append(seconds(_used(server) - began))
    return found


class Cost(NamedTuple):
    """The cost of edits in one database. `size`: bytes of one edit, with its share of indexes; `stored` and
    `verified`: edits in a second of processor time, that of the database server included."""

    name: str
    size: float
    stored: float
    verified: float


def measured() -> Iterator[Cost]:
    """Measure edits in each database that is here."""
    drafts = opening.changes(MEASURED)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as running:
        yield asyncio.run(_cost("SQLite", f"sqlite:///{Path(folder) / 'editor.db'}", drafts))
        if servers.binaries() is not None:
            server = running.enter_context(servers.server())
            yield asyncio.run(_cost("Postgres", server.new_database(), drafts, server))


def _used(server: servers.Server | None) -> float:
    """Return the processor time so far, in seconds, of this process and of a database server."""
    found = time.process_time()
    for each in server.processes() if server is not None else ():
        with contextlib.suppress(psutil.NoSuchProcess):
            found += sum(each.cpu_times()[:2])
    return found


async def _cost(
    name: str, url: str, drafts: list[Draft], server: servers.Server | None = None
) -> Cost:
    made = Draft(
        graph_events.CREATED, "ann", msgspec.json.encode(graph_events.GraphCreated("lab", ""))
    )
    async with _journal(url) as journal:
        for graph in range(_OPEN):
            await journal.append_all([Addition(graph_events.about_stream(f"g{graph}"), (made,))])
    async with _journal(url) as journal:
        before = (await journal.bytes_in_use())["database"]
        began = _used(server)
        for at in range(0, len(drafts), _WINDOW):
            stream = graph_events.graph_stream(f"g{at // _WINDOW % _OPEN}")
            await journal.append(stream, drafts[at : at + _WINDOW])
        stored = len(drafts) / (_used(server) - began)
    async with _journal(url) as journal:  # SQLite's file has it all once it was closed
        size = ((await journal.bytes_in_use())["database"] - before) / len(drafts)
        began = _used(server)
        assert await journal.verify() == []
        verified = len(drafts) / (_used(server) - began)
    return Cost(name, size, stored, verified)


@asynccontextmanager
async def _journal(url: str) -> AsyncIterator[Journal]:
    journal = await Journal.open(url, branch="editor", fold=graph_events.fold)
    try:
        yield journal
    finally:
        await journal.close()


def _duration(value: float) -> str:
    return f"{value / 60:.0f} min" if value < 5400 else f"{value / _HOUR:.1f} h"
