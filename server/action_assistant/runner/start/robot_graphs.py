"""Finds the actions of a graph that an engine cannot build, and those that stand for a graph of the robot's
own. Pure."""

from collections.abc import Collection

from action_assistant.runner.robots.engine import EngineIndex
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph


def not_matched(
    graph: Graph, facts: EngineFacts, index: EngineIndex, held: Collection[str]
) -> tuple[str, ...]:
    """Return the full names of the actions in `graph` that an engine cannot build.

    Some engines (`facts.restart_matches` is false) do not look actions up in their index when a
    graph is modified, or started under a name that they hold. Such an engine cannot build
    sub-graphs and actions that are not in `index`. If `index` is empty, return only the actions
    that stand for a graph in `held`, the running names that the engine holds. Empty for all other
    engines."""
    if facts.restart_matches:
        return ()
    silent = not index.actions and not index.graphs
    return tuple(
        action.full_name
        for action in graph.actions
        if not action.missing
        and (
            f"{graph.name}__{action.name}__{action.instance_id}" in held
            if silent
            else action.name not in index.actions
        )
    )


def not_matched_in(
    umrf: str, facts: EngineFacts, index: EngineIndex, held: Collection[str]
) -> tuple[str, ...]:
    """Read a graph as it will be sent and return its `not_matched`. For workers."""
    return not_matched(codec.read(umrf).graph, facts, index, held)


def unseen_graphs_in(
    umrf: str, index: EngineIndex, held: Collection[str], inner: Collection[str]
) -> tuple[str, ...]:
    """Read a graph as it will be sent, without graphs inside, and return the names of its actions that
    stand for a graph: one in `index`, in `held`, which names the graphs that the engine holds, or in
    `inner`, which names those that the run began with. For workers."""
    graph = codec.read(umrf).graph
    shown = {
        each.name
        for each in graph.actions
        if not each.missing and f"{graph.name}__{each.name}__{each.instance_id}" in held
    }
    return tuple(sorted({*unseen_graphs(graph, index, inner), *shown}))


def unseen_graphs(graph: Graph, index: EngineIndex, inner: Collection[str] = ()) -> set[str]:
    """Return the names of actions that stand for a graph in `index` or `inner`, and for no action there."""
    names = {each.name for each in graph.actions if not each.missing}
    return names & ({*index.graphs, *inner} - index.actions.keys())
