"""Selects the actions of a graph for which packages can be made: one for each name."""

from collections.abc import Iterator

import msgspec

from action_assistant.umrf.model import Action, Graph
from action_assistant.umrf.packages.naming import NameRefusal
from action_assistant.umrf.parameters import without_value
from action_assistant.umrf.signatures import signature_of


def distinct_actions(graph: Graph) -> tuple[Action, ...]:
    """Return the first action of each name in a graph, in its order, without values: each use of an
    action has its own values, which in the file of the action would apply to every graph."""
    found: dict[str, Action] = {}
    for action in graph.actions:
        if not action.missing:
            found.setdefault(action.name, action)
    return tuple(map(_without_values, found.values()))


def disagreements(graph: Graph) -> tuple[NameRefusal, ...]:
    """Return a refusal for each name whose actions have different parameters: the engine would find
    the package for some of them only."""
    return tuple(_disagreements(graph))


def _disagreements(graph: Graph) -> Iterator[NameRefusal]:
    first: dict[str, Action] = {}
    for action in graph.actions:
        if action.missing:
            continue
        other = first.setdefault(action.name, action)
        one, two = signature_of(other), signature_of(action)
        if (one.inputs, one.outputs) != (two.inputs, two.outputs):
            reason = (
                f"“{other.full_name}” and “{action.full_name}” have different parameters, and one "
                "package cannot be of both."
            )
            yield NameRefusal(action.name, reason)


def _without_values(action: Action) -> Action:
    return msgspec.structs.replace(
        action,
        inputs=tuple(map(without_value, action.inputs)),
        outputs=tuple(map(without_value, action.outputs)),
    )
