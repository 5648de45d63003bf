"""Graphs that an engine runs and that were not started from here."""

from collections.abc import Collection

from action_assistant.runner.links.port import Answer


def foreign_graphs(answer: Answer, going: Collection[str]) -> list[str]:
    """The graphs that an engine runs and that are no runs of ours `going` on there: also those of
    which no action has begun yet, or none moves right now. Sub-graphs are named by their graph."""
    held = {each.graph for each in answer.graphs}
    tops = {
        each.graph
        for each in answer.graphs
        if (each.active or (each.state == "RUNNING" and not _within(each.graph, held)))
        and (each.run is None or each.run not in going)
    }
    return sorted(name for name in tops if not _within(name, tops))


def _within(name: str, graphs: Collection[str]) -> bool:
    """Whether it is a sub-graph of one of them."""
    return any(name.startswith(f"{each}__") for each in graphs)
