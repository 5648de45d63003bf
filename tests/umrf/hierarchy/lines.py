"""Graphs and hierarchies of these tests, in a line each."""

from msgspec.structs import replace

from action_assistant.umrf.model import Action, Conditions, Graph, Parameter
from umrf.semantics.traces import graph_of


def inner(*arrows: str, name: str = "S", **conditions: Conditions) -> Graph:
    return replace(graph_of(*arrows, **conditions), name=name)


def with_values(graph: Graph, **values: tuple[dict[str, str], dict[str, str]]) -> Graph:
    """`with_values(graph, A=({"p": text}, {"q": text}))`: inputs and outputs of actions."""

    def sides(action: Action) -> Action:
        if action.name not in values:
            return action
        inputs, outputs = (
            tuple(Parameter(*p) for p in side.items()) for side in values[action.name]
        )
        return replace(action, inputs=inputs, outputs=outputs)

    return replace(graph, actions=tuple(map(sides, graph.actions)))


def changed(graph: Graph, which: str, **fields: object) -> Graph:
    actions = (replace(a, **fields) if a.name == which else a for a in graph.actions)
    return replace(graph, actions=tuple(actions))


CHAIN = graph_of("entry>A", "A>S", "S>B", "B>exit")
ONE = inner("entry>X", "X>exit")
TWO = inner("entry>X", "X>Y", "Y>exit")
