"""Graphs inside of graphs: checking, simulating and flattening 100 to 3,000 actions in 1 to 5 levels."""

import json
from collections.abc import Callable, Iterator
from typing import Any, Final

from table import Table, seconds

from action_assistant.umrf.check import check
from action_assistant.umrf.files.codec import read
from action_assistant.umrf.hierarchy.flattening import Flattened, flattened
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import simulate
from umrf import best_of

TITLE = "Hierarchies: chains in chains, the middle of each is the next level"
SIZES: Final = (100, 300, 1_000, 3_000)  # actions of all levels
LEVELS: Final = (1, 2, 3, 5)
ALWAYS: Final = ["on_true -> run", "on_false -> run", "on_error -> run", "on_stopped -> ignore"]


def levels_of(actions: int, levels: int) -> list[Graph]:
    """The graphs from the outermost to the innermost, with as many actions each."""
    return [_chain(level, actions // levels, level + 1 < levels) for level in range(levels)]


def _chain(level: int, count: int, has_inner: bool) -> Graph:
    names = [f"Step{n}" for n in range(count)]
    if has_inner:
        names.insert(count // 2, f"Level{level + 1}")

    def end(name: str) -> dict[str, Any]:
        return {"name": name, "instance_id": 0, "conditions": ALWAYS}

    actions = [
        {
            "name": name,
            "instance_id": 0,
            "type": "sync",
            "parents": [end(names[n - 1])] if n else [],
            "children": [end(names[n + 1])] if n + 1 < len(names) else [],
        }
        for n, name in enumerate(names)
    ]
    graph = {
        "graph_name": f"Level{level}",
        "graph_entry": [{"name": names[0], "instance_id": 0}],
        "graph_exit": [end(names[-1])],
        "actions": actions,
    }
    return read(json.dumps(graph)).graph


def tables() -> Iterator[Table]:
    """One row for each size and depth."""
    rows = []
    for size in SIZES:
        for levels in LEVELS:
            top, *below = levels_of(size, levels)
            measured = _operations(top, {graph.name: graph for graph in below})
            times = [seconds(best_of(operation)) for operation in measured.values()]
            is_flat = isinstance(flattened(top, {graph.name: graph for graph in below}), Flattened)
            rows.append([f"{size:,} in {levels}", *times, "yes" if is_flat else "undecided"])
    yield Table(["actions in levels", "check", "simulate", "flatten", "one graph"], rows)


def _operations(top: Graph, library: dict[str, Graph]) -> dict[str, Callable[[], Any]]:
    return {
        "check": lambda: check(top, graphs=library),
        "simulate": lambda: sum(1 for _ in simulate(top, library=library, max_events=10**9)),
        "flatten": lambda: flattened(top, library),
    }
