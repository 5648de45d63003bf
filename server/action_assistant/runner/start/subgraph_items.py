"""The item of a pre-flight about the graphs inside: whether the engine has indexed those that were pinned. Pure.

An engine runs what it has indexed under a name, whatever was sent (docs/umrf-and-the-engine.md 2.6).
"""

from collections.abc import Mapping, Sequence

from action_assistant.runner.index_folders.comparison import FileState, held_against, same_to_engine
from action_assistant.runner.index_folders.scan import IndexedFiles
from action_assistant.runner.robots.engine import EngineIndex
from action_assistant.runner.start.preflight import EngineView, Item
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.model import Graph

_TOLD = 3  # names in a sentence


def of_inside(view: EngineView, pinned: Mapping[str, Graph]) -> tuple[Item, ...]:
    """Whether it has indexed the graphs that were sent along; nothing where there are none. Pure."""
    if not pinned:
        return ()
    index = view.index
    if not index.actions and not index.graphs:
        text = (
            f"{view.name} names no graphs, so whether it runs {_listed(sorted(pinned))} as this version "
            "has it cannot be said."
        )
        return (Item(code="subgraphs", verdict="warned", text=text),)
    lacking, other = unlike(view, pinned)
    if not lacking and not other:
        text = f"{view.name} has indexed {_listed(sorted(pinned))} as this version has it."
        return (Item(code="subgraphs", verdict="passed", text=text),)
    told: list[str] = []
    if lacking:
        told.append(f"{view.name} has not indexed {_listed(lacking)}, and so refuses the graph.")
    if other:
        told.append(
            f"{view.name} has indexed {_listed(other)} otherwise than this version has it, and would "
            "run what it has."
        )
    codes = (*(["subgraph-differs"] if other else []), *(["unknown-action"] if lacking else []))
    item = Item(
        code="subgraphs", verdict="blocked", text=" ".join(told), codes=codes, overridable=True
    )
    return (item,)


def unlike(view: EngineView, pinned: Mapping[str, Graph]) -> tuple[list[str], list[str]]:
    """The names of graphs that the engine has not indexed, and of those that it has otherwise."""
    index = view.index
    lacking = [each for each in sorted(pinned) if not _is_known(each, index)]
    other = [
        name
        for name, graph in sorted(pinned.items())
        if _is_known(name, index) and not _is_same(name, graph, index, view.facts)
    ]
    return lacking, other


def of_index(
    graph: Graph, files: IndexedFiles, index: EngineIndex, facts: EngineFacts
) -> FileState:
    """How a graph is in the folder of an engine that has named this index."""
    return held_against(graph, files, facts, actions=index.actions, graphs=index.graphs)


def _is_known(name: str, index: EngineIndex) -> bool:
    return name in index.graphs or name in index.actions


def _is_same(name: str, graph: Graph, index: EngineIndex, facts: EngineFacts) -> bool:
    """Whether the engine would run just this; an action of that name comes before a graph."""
    if name in index.actions:
        return False
    return same_to_engine(graph, index.graphs[name], facts)


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _TOLD} more" if len(names) > _TOLD else ""
    return f"{', '.join(names[:_TOLD])}{more}"
