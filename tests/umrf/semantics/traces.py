"""Graphs in one line, and summaries of traces of the simulated engine."""

import msgspec

from action_assistant.umrf.model import ENTRY, EXIT, Action, Conditions, Graph, Relation
from action_assistant.umrf.semantics import (
    Behaviour,
    GraphResultEvent,
    GraphStateEvent,
    HazardEvent,
    NodeStateEvent,
    Script,
    Trace,
)

RUN = Conditions("run", "run", "run", "ignore")


def graph_of(*arrows: str, **conditions: Conditions) -> Graph:
    """`graph_of("entry>A", "A>B", "B>exit", AB=…)`: actions by their names, `RUN` on all arrows."""
    names = dict.fromkeys(n for a in arrows for n in a.split(">") if n not in (ENTRY, EXIT))
    relations = []
    for place, arrow in enumerate(arrows):
        parent, child = arrow.split(">")
        answers = conditions.get(f"{parent}{child}", RUN)
        order = float(place)
        relations.append(
            Relation(
                parent=parent,
                child=child,
                conditions=answers,
                parent_order=order,
                child_order=order,
            )
        )
    actions = tuple(Action(key=name, name=name) for name in names)
    return Graph(name="g", actions=actions, relations=tuple(relations))


def optional(graph: Graph, *arrows: str) -> Graph:
    """Return the graph with these relations not required."""
    changed = tuple(
        msgspec.structs.replace(r, required=f"{r.parent}>{r.child}" not in arrows)
        for r in graph.relations
    )
    return msgspec.structs.replace(graph, relations=changed)


def states(traces: list[Trace], node: str) -> list[str]:
    return [t.state for t in traces if isinstance(t, NodeStateEvent) and t.node == f"{node}_0"]


def graph_states(traces: list[Trace], graph: str = "g") -> list[str]:
    return [t.state for t in traces if isinstance(t, GraphStateEvent) and t.graph == graph]


def hazards(traces: list[Trace]) -> list[str]:
    return [t.code for t in traces if isinstance(t, HazardEvent)]


def results(traces: list[Trace]) -> list[str]:
    return [t.value for t in traces if isinstance(t, GraphResultEvent)]


def script(**calls: list[Behaviour]) -> Script:
    return Script({name: tuple(behaviours) for name, behaviours in calls.items()})
