"""Cuts a graph into pieces of one action each, and reads the outcome of a piece from its states. An
action that stands for a graph is such a piece, too (`led_subgraphs`).

A led run sends each robot one piece at a time (docs/umrf-and-the-engine.md 5). The exit of a
piece runs only for `on_true`, so the states of the graph and of its action tell the outcome, which
an engine otherwise never reports. Pure.
"""

from collections.abc import Collection, Iterator, Mapping
from typing import Final

import msgspec

from action_assistant.umrf.kept_values import names_in_words, unreadable_arrows, value_arrows
from action_assistant.umrf.model import (
    ENTRY,
    ENTRY_CONDITIONS,
    EXIT,
    PRECONDITIONS,
    Action,
    Conditions,
    Graph,
    Key,
    Precondition,
    Relation,
)

#: The exit of a piece: only `on_true` reaches it, so that each outcome has states of its own.
TELLING: Final = Conditions(on_true="run")
#: The outcome of a piece by the state of its graph and of its action.
_OUTCOMES: Final[Mapping[tuple[str, str], Precondition]] = {
    ("FINISHED", "FINISHED"): "on_true",
    ("HALTED", "FINISHED"): "on_false",
    ("HALTED", "ERROR"): "on_error",
    ("STOPPED", "FINISHED"): "on_stopped",
}


class Obstacle(msgspec.Struct, frozen=True, kw_only=True):
    """A reason why a graph cannot be cut into pieces. `code` names the rule, `text` is a sentence
    for people, `aid` is the key of the action that it concerns."""

    code: str
    text: str
    aid: Key | None = None


def piece_name(graph: str, action: str, visit: str = "") -> str:
    """Return the name under which a robot runs the piece of an action. `graph`: the name of the
    whole graph; `action`: the full name; `visit`: an id of this one execution of the action, if
    each needs a name of its own, else "". No sub-graph of the whole graph has this name."""
    return f"{graph}--{action}--v{visit}" if visit else f"{graph}--{action}"


def piece_of(graph: Graph, action: Action, visit: str = "") -> Graph:
    """Return the graph that has only this action of `graph`, with the values that stand in it.
    `visit`: an id that is put into its name if each visit needs a name of its own, else ""."""
    alone = msgspec.structs.replace(action, actor="", position=None)
    return Graph(
        name=piece_name(graph.name, action.full_name, visit),
        actions=(alone,),
        relations=(
            Relation(parent=ENTRY, child=action.key, conditions=ENTRY_CONDITIONS),
            Relation(parent=action.key, child=EXIT, conditions=TELLING),
        ),
    )


def outcome_of(graph_state: str | None, action_state: str) -> Precondition | None:
    """Return the outcome of a piece by the states of its graph and action; None while it is not
    over, and for states that show no outcome, such as ERROR of the graph."""
    return _OUTCOMES.get((graph_state or "", action_state))


def obstacles(graph: Graph) -> tuple[Obstacle, ...]:
    """Return the reasons why a graph cannot run as pieces; empty if it can. Sub-graphs are checked
    by `subgraph_obstacles`."""
    return (
        *_values_across(graph),
        *_spontaneous(graph),
        *_pauses(graph),
    )


def handed_by(graph: Graph, actions: Collection[Key]) -> tuple[Obstacle, ...]:
    """Return an obstacle for each arrow by which one of these actions (keys) hands values to
    others: that needs the helper package on the robot that carries them out."""
    return tuple(
        Obstacle(code="values-across", text=_hands(graph, arrow, handed), aid=arrow.child)
        for arrow, handed in value_arrows(graph)
        if arrow.parent in actions
    )


def _values_across(graph: Graph) -> Iterator[Obstacle]:
    """Yield an obstacle for each arrow whose values cannot be handed from one piece to another even
    with the helper package."""
    for arrow, handed, why in unreadable_arrows(graph, tuple(value_arrows(graph))):
        text = f"{_hands(graph, arrow, handed)}: {why}"
        yield Obstacle(code="values-across", text=text, aid=arrow.child)


def _hands(graph: Graph, arrow: Relation, outputs: Collection[str]) -> str:
    """Return in words that an arrow hands these outputs on, with the names of both actions."""
    names = {action.key: action.full_name for action in graph.actions}
    return f"{names[arrow.parent]} hands {names_in_words(outputs)} to {names[arrow.child]}"


def _spontaneous(graph: Graph) -> Iterator[Obstacle]:
    for action in graph.actions:
        if action.type == "spontaneous" and not action.missing:
            text = (
                f"{action.full_name} is spontaneous: it begins again by itself, which cannot be led "
                "step by step."
            )
            yield Obstacle(code="spontaneous-across", text=text, aid=action.key)


def _pauses(graph: Graph) -> Iterator[Obstacle]:
    """Yield an obstacle for each arrow that pauses an action: no engine does that safely for one
    piece."""
    actions = {action.key: action for action in graph.actions if not action.missing}
    for relation in graph.relations:
        child, conditions = actions.get(relation.child), relation.conditions
        if child is not None and "pause" in map(conditions.answer, PRECONDITIONS):
            text = (
                f"An arrow pauses {child.full_name}: an action that a robot carries out alone can "
                "only be started and stopped."
            )
            yield Obstacle(code="pause-across", text=text, aid=child.key)
