"""Graphs that the gestures of the page draw end on the engine when every action ends with on_true.

`frontend/src/graph/edit/waits.test.ts` draws them, and keeps them in `tests/vectors/drawn.json`: for
each graph its arrows, as "PARENT CHILD OUTCOMES", with "?" after those that are not waited for.
`series.test.ts` beside it draws copies of actions, one after another, into such graphs.
"""

import json
import os
from pathlib import Path

import pytest

from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    Action,
    Conditions,
    Graph,
    Relation,
)
from action_assistant.umrf.semantics.simulate import simulate
from action_assistant.umrf.semantics.trace import GraphStateEvent, NodeStateEvent

VECTORS = Path(os.environ.get("DRAWN_FILE", Path(__file__).parents[1] / "vectors" / "drawn.json"))
DRAWN: list[list[str]] = json.loads(VECTORS.read_text())
SERIES_FILE = os.environ.get("SERIES_FILE", Path(__file__).parents[1] / "vectors" / "series.json")
SERIES: list[list[str]] = json.loads(Path(SERIES_FILE).read_text())


def graph_of(arrows: list[str]) -> Graph:
    """Return the graph with these arrows."""
    relations: list[Relation] = []
    names: set[str] = set()
    for order, each in enumerate(arrows):
        parent, child, outcomes, *optional = each.split()
        said = {f"on_{outcome}": "run" for outcome in outcomes.split("/")}
        ignore = {f"on_{outcome}": "ignore" for outcome in ("true", "false", "error", "stopped")}
        relations.append(
            Relation(
                parent=parent, child=child, required=not optional, parent_order=order,
                conditions=ENTRY_CONDITIONS if parent == ENTRY else Conditions(**(ignore | said)),
            )
        )  # fmt: skip
        names |= {parent, child}
    actions = tuple(Action(key=n, name=n, type="sync") for n in sorted(names - {ENTRY, EXIT}))
    return Graph(name="drawn", actions=actions, relations=tuple(relations))


@pytest.mark.parametrize("arrows", DRAWN + SERIES, ids=lambda arrows: " · ".join(arrows)[:60])
def test_what_gestures_draw_ends_when_every_action_ends_true(arrows: list[str]) -> None:
    trace = list(simulate(graph_of(arrows), max_events=2_000))
    states = {each.state: each.t_ms for each in trace if isinstance(each, GraphStateEvent)}
    assert "FINISHED" in states, f"the graph stays {list(states)[-1]}"
    late = [
        each
        for each in trace
        if isinstance(each, NodeStateEvent) and each.t_ms > states["FINISHED"]
    ]
    assert late == [], "an action runs on in a graph that no Stop reaches any more"
