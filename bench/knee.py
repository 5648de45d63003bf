"""How much one editor carries, against Hocuspocus, in turn: at which rate of edits everybody still hears of
them within a tenth of a second.

`BENCH_BEFORE` names the folder `server` of an earlier version, to be measured beside the two.
"""

import os
import statistics
from collections.abc import Iterator, Mapping
from typing import Any, Final

from peers import Hocuspocus, Ours, Peer, running
from table import Table

TITLE = "What one editor carries"
PATIENCE_MS: Final = 100.0  # in which nearly all edits (the 99th percentile) reach everybody
STEP: Final = 1.25  # times as many edits from one load to the next
RUNS: Final = int(os.environ.get("BENCH_RUNS", "3"))
#: With how many edits a second of each person it begins.
CROWDS: Final[dict[str, tuple[dict[str, Any], float]]] = {
    "500 people, 100 graphs": ({"people": 500, "graphs": 100}, 6),
    "2,000 people, 500 graphs": ({"people": 2000, "graphs": 500}, 0.6),
}


class Before(Ours):
    """The editor as it was."""

    name = "before"

    def environment(self) -> dict[str, str]:
        return {**super().environment(), "PYTHONPATH": os.environ["BENCH_BEFORE"]}


def tables() -> Iterator[Table]:
    """One row for each crowd and server: the most that it carried, in the middle of some climbs."""
    kinds = [Ours, Hocuspocus, *([Before] if "BENCH_BEFORE" in os.environ else [])]
    rows: list[list[str]] = []
    for crowd, (plan, rate) in CROWDS.items():
        climbs: dict[str, list[Mapping[str, float]]] = {kind.name: [] for kind in kinds}
        for _ in range(RUNS):
            for kind in kinds:
                climbs[kind.name].append(climbed(kind, plan, rate))
        for name, found in climbs.items():
            rates = [each["rate"] for each in found]
            at_knee = min(found, key=lambda each: abs(each["rate"] - statistics.median(rates)))
            told = f"{statistics.median(rates):.1f} ({min(rates):.1f}–{max(rates):.1f})"
            figures = [f"{at_knee['delivered_per_s']:,.0f}", f"{at_knee['p99_ms']:.0f} ms"]
            rows.append([crowd, name, told, *figures, f"{at_knee['cpu_share'] * 100:.0f} %"])
    head = ["crowd", "server", "edits/s of each", "delivered per second", "p99 then", "CPU then"]
    yield Table(head, rows)


def climbed(kind: type[Peer], plan: dict[str, Any], rate: float) -> Mapping[str, float]:
    """The last run before a load at which edits were late or missing, twice: once may be the disk's."""
    best: dict[str, float] = {"rate": 0.0, "delivered_per_s": 0.0, "p99_ms": 0.0, "cpu_share": 0.0}
    while (found := carried(kind, plan, rate) or carried(kind, plan, rate)) is not None:
        best = {**found, "rate": rate}
        rate *= STEP
    return best


def carried(kind: type[Peer], plan: dict[str, Any], rate: float) -> Mapping[str, float] | None:
    """What a fresh server did under this load; None where that was too much."""
    people = {name: value for name, value in plan.items() if name != "graphs"}
    with running(kind) as peer:
        found = peer.under("fan out", peer.rooms(plan["graphs"]), rate=rate, **people)
    late = found["p99_ms"] > PATIENCE_MS or found["missing"] or found["disconnected"]
    return None if late else found
