"""Rooms under load, against Hocuspocus with SQLite, in turn: cost, delay and memory."""

import os
import statistics
from collections.abc import Iterator, Sequence
from typing import Any, Final

from peers import Hocuspocus, Ours, running
from table import Table

TITLE = "Rooms: ours at full durability, Hocuspocus with SQLite (which stores seconds later)"
RUNS: Final = int(os.environ.get("BENCH_RUNS", "5"))  # of each, in turn
Run = dict[str, Any]
KINDS: Final = (Ours, Hocuspocus)
#: Rounds in which some do something at the same time, and the next one comes when all has arrived.
LOCKSTEP: Final[dict[str, dict[str, Any]]] = {
    "50 people, one graph; 5 edit": {"people": 50, "count": 300, "burst": 5},
    "100 people, 20 graphs; 10 edit": {"people": 100, "graphs": 20, "count": 200, "burst": 10},
    "50 people; 15 drag by edits": {"people": 50, "count": 300, "burst": 15, "kind": "drag"},
    "50 people; 10 by awareness": {"people": 50, "count": 300, "burst": 10, "kind": "presence"},
}
#: Everybody at a rate of their own, whatever the server does.
OPEN: Final[dict[str, dict[str, Any]]] = {
    "20 people, 5 graphs, 4 edits/s each": {"people": 20, "rate": 4, "graphs": 5},
    "50 people, one graph, 10 edits/s each": {"people": 50, "rate": 10},
    "100 people, 20 graphs, 10 edits/s each": {"people": 100, "rate": 10, "graphs": 20},
    "50 people drag by edits, 30/s each": {"people": 50, "rate": 30, "kind": "drag"},
    "50 people drag by awareness, 20/s each": {"people": 50, "rate": 20, "kind": "presence"},
}
#: What one editor can carry.
MANY: Final[dict[str, dict[str, Any]]] = {
    "500 people, 100 graphs, 5 edits/s each": {"people": 500, "rate": 5, "graphs": 100},
    "500 people, 100 graphs, 14 edits/s each": {"people": 500, "rate": 14, "graphs": 100},
    "2,000 people, 500 graphs, 1 edit/s each": {"people": 2000, "rate": 1, "graphs": 500},
}


def tables() -> Iterator[Table]:
    """Rounds; loads; many people. A cell has our figure, then that of Hocuspocus."""
    rounds = ("cost", "ratio", "p50", "p99")
    loads = ("cost", "ratio", "CPU", "p50", "p99", "memory")
    yield Table(_head("in rounds", rounds), list(_rows("lockstep", LOCKSTEP, RUNS, rounds)))
    yield Table(_head("load", loads), list(_rows("fan out", OPEN, RUNS, loads)))
    yield Table(_head("load", loads), list(_rows("fan out", MANY, RUNS, loads)))


def _head(first: str, figures: Sequence[str]) -> list[str]:
    headings = {"cost": "CPU per delivered, µs", "p50": "p50, ms", "p99": "p99, ms"}
    headings |= {"CPU": "CPU, %", "memory": "memory, MB"}
    return [first, *(headings.get(figure, figure) for figure in figures)]


def in_turn(operation: str, plan: dict[str, Any], count: int) -> dict[str, list[Run]]:
    """Runs of each server, always on a fresh one."""
    found: dict[str, list[Run]] = {kind.name: [] for kind in KINDS}
    graphs = plan.get("graphs", 1)
    rest = {name: value for name, value in plan.items() if name != "graphs"}
    for _ in range(count):
        for kind in KINDS:
            with running(kind) as peer:
                found[kind.name].append(peer.under(operation, peer.rooms(graphs), **rest))
    return found


def _rows(
    operation: str, loads: dict[str, dict[str, Any]], count: int, figures: Sequence[str]
) -> Iterator[list[str]]:
    """Yield one row for each load. The ratio is that of two runs in turn, with the least and the most;
    all other figures are medians. Edits that did not arrive are named beside the load."""
    for load, plan in loads.items():
        found = in_turn(operation, plan, count)
        ratios = [
            ours["cpu_us"] / theirs["cpu_us"]
            for ours, theirs in zip(found[Ours.name], found[Hocuspocus.name], strict=True)
        ]
        cells = {
            name: " / ".join(_figure(runs, name) for runs in found.values())
            for name in figures
            if name != "ratio"
        }
        cells["ratio"] = f"{statistics.median(ratios):.2f} ({min(ratios):.2f}–{max(ratios):.2f})"
        lost = [sum(run["missing"] for run in runs) for runs in found.values()]
        if any(lost):
            load = f"{load}; missing: {lost[0]} / {lost[1]}"
        yield [load, *(cells[name] for name in figures)]


def _figure(runs: Sequence[Run], name: str) -> str:
    """Return one figure of the runs of one server, without its unit."""
    if name == "CPU":
        return f"{median(runs, 'cpu_share') * 100:.0f}"
    if name == "memory":
        return f"{median(runs, 'memory_mb'):.0f}"
    keys = {"cost": "cpu_us", "p50": "p50_ms", "p99": "p99_ms"}
    return f"{median(runs, keys[name]):.1f}"


def median(runs: Sequence[Run], figure: str) -> float:
    return statistics.median(run[figure] for run in runs)
