"""Finds the indexed action or graph that a node stands for (docs/umrf-and-the-engine.md 2.1)."""

from collections.abc import Collection, Container, Iterator, Mapping
from typing import Final, Literal

import msgspec

from action_assistant.umrf.json.text import parse_small
from action_assistant.umrf.model import ENTRY, EXIT, Action, Graph, Key, Parameter, Signature
from action_assistant.umrf.parameters import flat_name
from action_assistant.umrf.semantics.parts import Node
from action_assistant.umrf.semantics.values import slots_of

#: The most actions that are examined while sub-graphs of sub-graphs are resolved. Their number can double with each
#: level, in the engine too.
BUDGET: Final = 20_000


class Unresolved(msgspec.Struct, frozen=True):
    """A sub-graph that the engine does not look up. `name`: the sub-graph; `action`: the action of
    the top graph that leads to it.

    `recursion`: it is one of the graphs around it. `again`: the engine has used it already, in the
    same graph or in one around it.
    """

    why: Literal["recursion", "again"]
    action: Action
    name: str


class IndexedGraphs:
    """Finds the indexed graphs that actions can stand for.

    The inputs and outputs of each graph are computed once, however many actions ask: a small file
    has room for ten thousand that do.
    """

    def __init__(self, library: Mapping[str, Graph]) -> None:
        self._library = library
        self._known: dict[str, tuple[set[str], set[str]]] = {}

    def fitting(self, name: str, inputs: Collection[str], outputs: Collection[str]) -> Graph | None:
        """Return the indexed graph with this name if its inputs and outputs are exactly those with
        the given flat names; None otherwise."""
        sub = self._library.get(name)
        if sub is None:
            return None
        if name not in self._known:
            self._known[name] = _expected(sub)
        return sub if (set(inputs), set(outputs)) == self._known[name] else None


class _Level:
    """One graph while its actions are resolved. `above`: its own name and the names of the graphs
    around it. `used`: names of graphs that the engine has taken off its list here."""

    def __init__(self, graph: Graph, above: frozenset[str], used: frozenset[str]) -> None:
        self.above = above | {graph.name}
        self.used = set(used | self.above)
        real = (action for action in graph.actions if not action.missing)
        self.left = iter(sorted(real, key=lambda action: action.full_name.encode()))


def unresolved(
    graph: Graph, library: Mapping[str, Graph], known: Container[str], actor: str = ""
) -> Iterator[Unresolved]:
    """Yield the sub-graphs for which an engine refuses this graph although it has indexed them.
    `library`: the indexed graphs by name. `known`: names of plain actions, which take precedence
    over graphs. `actor`: the engine's name; if it is empty, each actor of the graph has an engine,
    which resolves its own actions and the ones without an actor."""
    named = {action.actor for action in graph.actions if not action.missing} - {""}
    for each in [actor] if actor else sorted(named) or [""]:
        yield from _unresolved_by(("", each), graph, library, known)


def _unresolved_by(
    own: tuple[str, str], graph: Graph, library: Mapping[str, Graph], known: Container[str]
) -> Iterator[Unresolved]:
    """Yield the sub-graphs that the engine which resolves the actions of the actors `own` refuses.
    `library`: the indexed graphs by name; `known`: names of plain actions. The engine goes through
    the actions by full name. Once it has used a graph, it takes this graph off its list for the
    later actions of the same graph and for all graphs inside, but not for graphs beside it. So the
    engine refuses one sub-graph twice in one graph, and a sub-graph beside a later one that
    contains it; it accepts the same sub-graph inside two different ones (measured)."""
    indexed = IndexedGraphs(library)
    levels = [_Level(graph, frozenset(), frozenset())]
    top: Action | None = None
    for _ in range(BUDGET):
        if not levels:
            return
        level = levels[-1]
        action = next(level.left, None)
        if action is None:
            levels.pop()
            continue
        top = action if len(levels) == 1 or top is None else top
        if action.name not in library or action.actor not in own or action.name in known:
            continue
        given = slots_of(action.inputs).keys(), slots_of(action.outputs).keys()
        sub = indexed.fitting(action.name, *given)
        if sub is None:
            continue
        if sub.name in level.used:
            yield Unresolved("recursion" if sub.name in level.above else "again", top, sub.name)
            continue
        level.used.add(sub.name)
        levels.append(_Level(sub, level.above, frozenset(level.used)))


def has_action(node: Node, known: Signature | None) -> bool:
    """Return whether an action of the index with the signature `known` has exactly the inputs and
    outputs of a node. `known`: None if the index has no such action; the result is False then."""
    return (
        known is not None
        and set(node.inputs) == set(known.inputs)
        and set(node.outputs) == set(known.outputs)
    )


def _expected(sub: Graph) -> tuple[set[str], set[str]]:
    """Return the names of the inputs and of the outputs that a graph has as a sub-graph."""
    entries = {r.child for r in sub.relations if r.parent == ENTRY}
    exits = sorted((r.child_order, r.parent) for r in sub.relations if r.child == EXIT)
    ends = {key for _, key in exits}
    inputs: set[str] = set()
    given: dict[Key, set[str]] = {}
    for action in sub.actions:
        if action.key in entries:
            inputs |= {name for name, has_value in _leaves(action.inputs) if not has_value}
        if action.key in ends:
            given.setdefault(action.key, set()).update(name for name, _ in _leaves(action.outputs))
    outputs: set[str] = set()
    for _, key in exits:
        outputs = given.get(key) or outputs
    return inputs, outputs


def _leaves(parameters: tuple[Parameter, ...]) -> list[tuple[str, bool]]:
    found = []
    for parameter in parameters:
        leaf = parse_small(parameter.text)
        if isinstance(leaf, dict) and "pvf_type" in leaf:
            found.append((flat_name(parameter.path), "pvf_value" in leaf))
    return found
