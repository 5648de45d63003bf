"""Reading, writing, checking, simulating and digesting graphs of 100 to 10,000 actions."""

import gc
import json
import time
from collections.abc import Callable, Iterator
from typing import Any

from table import Table, seconds

from action_assistant.umrf.check import check
from action_assistant.umrf.digest import digest
from action_assistant.umrf.files.codec import read, write
from action_assistant.umrf.model import Graph
from action_assistant.umrf.semantics import simulate

TITLE = "UMRF: a chain in which every third action chooses between two ways that meet again"
SIZES = (100, 1_000, 10_000)
SAFE = ["on_error -> ignore", "on_stopped -> ignore"]
TEXT = {"pvf_type": "string", "pvf_value": "somewhere"}


def graph_of(count: int) -> dict[str, Any]:
    """Groups of four: a choice, two ways, a join; each hands a text and a number to the next."""
    actions: list[dict[str, Any]] = []
    for start in range(0, count, 4):
        before = f"Join{start - 4}" if start else None
        choice, join = f"Choose{start}", f"Join{start}"
        ways = {"on_true": f"Left{start}", "on_false": f"Right{start}"}
        actions.append(action(choice, [(before, SAFE)] if before else [], list(ways.values())))
        for outcome, way in ways.items():
            other = "on_false" if outcome == "on_true" else "on_true"
            actions.append(action(way, [(choice, [f"{other} -> ignore", *SAFE])], [join]))
        after = [f"Choose{start + 4}"] if start + 4 < count else []
        joined = [(way, SAFE) for way in ways.values()]
        actions.append(action(join, joined, after, required=False))
    return {
        "graph_name": "bench",
        "graph_entry": [{"name": actions[0]["name"]}],
        "graph_exit": [{"name": actions[-1]["name"], "conditions": SAFE}],
        "actions": actions,
    }


def action(
    name: str, parents: list[tuple[str, list[str]]], children: list[str], required: bool = True
) -> dict[str, Any]:
    """One action with parameters and a place."""
    x = {"pvf_type": "number", "pvf_value": 1.5}
    return {
        "name": name,
        "type": "sync",
        "input_parameters": {"place": TEXT, "pose": {"x": x, "y": x}},
        "output_parameters": {"place": TEXT, "pose": {"x": x, "y": x}},
        "parents": [{"name": p, "conditions": c, "required": required} for p, c in parents],
        "children": [{"name": c, "remap": [{"from": "place", "to": "place"}]} for c in children],
        "gui_attributes": {"position": {"x": 1.0, "y": 2.0}},
    }


def best_of(operation: Callable[[], Any]) -> float:
    """The shortest of three runs, in s of the processor, so that other work does not count."""
    times = []
    for _ in range(3):
        gc.collect()
        start = time.process_time()
        operation()
        times.append(time.process_time() - start)
    return min(times)


def operations(text: str, graph: Graph) -> dict[str, Callable[[], Any]]:
    """What is measured."""
    return {
        "read": lambda: read(text),
        "write": lambda: write(graph),
        "check": lambda: check(graph),
        "simulate": lambda: sum(1 for _ in simulate(graph, max_events=10**9)),
        "digest": lambda: digest(graph),
    }


def tables() -> Iterator[Table]:
    """One table: times by size, and by how much ten times as many actions take longer."""
    measured: dict[str, list[float]] = {}
    for size in SIZES:
        text = json.dumps(graph_of(size))
        for name, operation in operations(text, read(text).graph).items():
            measured.setdefault(name, []).append(best_of(operation))
    head = ["", *(f"{size:,} actions" for size in SIZES), "× per ten", "× per ten"]
    rows = [
        [name, *map(seconds, times), f"{times[1] / times[0]:.1f}", f"{times[2] / times[1]:.1f}"]
        for name, times in measured.items()
    ]
    yield Table(head, rows)
