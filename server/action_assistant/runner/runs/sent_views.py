"""What was sent at a start, as pages and programs get it: the graph, and the graphs inside of it."""

import msgspec

from action_assistant.runner.links.parameter_texts import sent
from action_assistant.runner.runs.events import Requested, RunSubgraph
from action_assistant.umrf.json.embedded import UmrfGraph


class SubgraphShown(msgspec.Struct, frozen=True):
    """A graph inside of the one that was started, as it was sent along, by the name of the actions that
    stand for it. `graph`: its id; `version`: of it, where there was one."""

    name: str
    version: str | None
    digest: str
    umrf: UmrfGraph
    graph: str | None


class Sent(msgspec.Struct, frozen=True):
    """A graph as it was sent, and the values of its actions."""

    umrf: str
    values: dict[str, dict[str, str]]
    subgraphs: tuple[RunSubgraph, ...] = ()
    tree_digest: str | None = None


def sent_of(start: Requested) -> Sent:
    """For workers: reads the graph."""
    return Sent(start.umrf, sent(start.umrf), start.subgraphs, start.tree_digest)


def subgraphs_shown(start: Sent) -> list[SubgraphShown]:
    """The graphs inside."""
    return [
        SubgraphShown(
            each.name, each.version, each.digest, msgspec.Raw(each.umrf.encode()), each.graph
        )
        for each in start.subgraphs
    ]
