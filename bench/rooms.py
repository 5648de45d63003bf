"""Rooms under load, against Hocuspocus with SQLite: cost, delay and memory."""

import os
import statistics
from collections.abc import Iterator
from typing import Any, Final

from peers import Hocuspocus, Ours, running
from table import Table

TITLE = "Rooms: ours at full durability, Hocuspocus with SQLite (which stores seconds later)"
RUNS: Final = int(os.environ.get("BENCH_RUNS", "3"))  # of each, in turn
LOADS: Final[dict[str, dict[str, Any]]] = {
    "50 people, one graph, 10 edits/s each": {"people": 50, "rate": 10},
    "100 people, 20 graphs, 10 edits/s each": {"people": 100, "rate": 10, "graphs": 20},
    "50 people drag by edits, 30/s each": {"people": 50, "rate": 30, "kind": "drag"},
    "50 people drag by awareness, 20/s each": {"people": 50, "rate": 20, "kind": "presence"},
}
IDLE: Final = 1000


def tables() -> Iterator[Table]:
    """Loads; then sockets that only stand there."""
    head = ["load", "server", "CPU per delivered", "CPU", "p50", "p99", "missing", "memory"]
    rows: list[list[str]] = []
    for load, plan in LOADS.items():
        found: dict[str, list[dict[str, Any]]] = {"ours": [], "Hocuspocus": []}
        for _ in range(RUNS):
            for kind in (Ours, Hocuspocus):
                found[kind.name].append(one(kind, **plan))
        rows += [row(load, name, runs) for name, runs in found.items()]
    yield Table(head, rows)
    head = [f"{IDLE:,} idle sockets", "memory", "CPU per connection"]
    rows = []
    for kind in (Ours, Hocuspocus):
        with running(kind) as peer:
            cost = peer.under("idle", peer.rooms(100), people=IDLE)
        rows.append([kind.name, f"{cost['memory_mb']:.1f} MB", f"{cost['connect_ms']:.2f} ms"])
    yield Table(head, rows)


def one(server: type[Ours | Hocuspocus], *, graphs: int = 1, **plan: Any) -> dict[str, Any]:
    """One run on a fresh server."""
    with running(server) as peer:
        return peer.under("fan out", peer.rooms(graphs), **plan)


def row(load: str, name: str, runs: list[dict[str, Any]]) -> list[str]:
    """The median of each figure; of what went missing the sum."""

    def median(figure: str) -> float:
        return statistics.median(run[figure] for run in runs)

    return [
        load,
        name,
        f"{median('cpu_us'):.1f} µs",
        f"{median('cpu_share') * 100:.0f} %",
        f"{median('p50_ms'):.1f} ms",
        f"{median('p99_ms'):.1f} ms",
        str(sum(run["missing"] for run in runs)),
        f"{median('memory_mb'):.0f} MB",
    ]
