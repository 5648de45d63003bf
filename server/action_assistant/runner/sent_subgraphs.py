"""The graphs inside of a graph that is sent: by value, as its version has them, and proven by their digests.

See docs/decisions/070-one-truth-for-sub-graphs.md.
"""

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import msgspec

from action_assistant.errors import BadInput, Conflict, NotUmrf, Refused, TooLarge
from action_assistant.runner.runs.events import RunSubgraph
from action_assistant.runner.sent_graph import SentGraph, read_sent
from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph
from action_assistant.umrf.run_size import MOST_INSIDE


class SentSubgraph(msgspec.Struct, frozen=True, kw_only=True):
    """A graph inside of the one that is sent, by the name of the actions that stand for it. `version`
    and `graph`: where it comes from."""

    name: str
    digest: str = ""
    umrf: SentGraph
    version: str | None = None
    graph: str | None = None


Inner: TypeAlias = Mapping[str, Graph]


def read_inside(
    sent: Sequence[SentSubgraph],
    own: str,
    tree: str | None,
    *,
    approved: bool = True,
) -> tuple[tuple[RunSubgraph, ...], dict[str, Graph]]:
    """What was sent, as it is recorded, and the graphs by name. `own`: the digest of the graph around
    them; `tree`: of all together, if it is known. Before a graph is `approved` nobody needs to know
    digests. For workers. Raises BadInput, NotUmrf, TooLarge, Conflict with the place."""
    if len(sent) > MOST_INSIDE:
        raise TooLarge(f"A graph that is sent has at most {MOST_INSIDE} graphs inside.")
    told: list[RunSubgraph] = []
    graphs: dict[str, Graph] = {}
    for place, each in enumerate(sent):
        text, graph, found = _read(place, each)
        if graph.name != each.name or each.name in graphs:
            what = "comes twice" if each.name in graphs else f"is called {graph.name!r} in its text"
            raise BadInput(
                f"The sub-graph {each.name!r} {what}.", where={"path": f"/subgraphs/{place}/name"}
            )
        if found != each.digest and (approved or each.digest):
            raise Conflict(
                f"The sub-graph {each.name!r} that was sent is not the one that was approved: its digest "
                f"is {found[:12]}…, not {each.digest[:12]}…. Nothing was started.",
                where={"path": f"/subgraphs/{place}/digest"},
            )
        graphs[each.name] = graph
        told.append(RunSubgraph(each.name, each.version, found, text.decode(), each.graph))
    _require_tree(told, own, tree)
    return tuple(told), graphs


def graphs_in(subgraphs: Sequence[RunSubgraph]) -> dict[str, Graph]:
    """The recorded graphs by name; those that can be read. For workers."""
    found: dict[str, Graph] = {}
    for each in subgraphs:
        try:
            found[each.name] = codec.read(each.umrf.encode()).graph
        except codec.Unreadable:
            continue
    return found


def tree_of(own: str, subgraphs: Sequence[RunSubgraph]) -> str:
    """The digest of a graph together with those inside of it."""
    return tree_digest(own, ((each.name, each.digest) for each in subgraphs))


def _read(place: int, sent: SentSubgraph) -> tuple[bytes, Graph, str]:
    try:
        text, reading = read_sent(bytes(sent.umrf))
    except (BadInput, NotUmrf) as wrong:
        where: dict[str, Any] = {**(wrong.where or {})}
        where["path"] = f"/subgraphs/{place}{where.get('path', '/umrf')}"
        kind: type[Refused] = type(wrong)
        raise kind(wrong.detail, where=where) from wrong
    return text, reading.graph, digest(reading.graph)


def _require_tree(told: Sequence[RunSubgraph], own: str, tree: str | None) -> None:
    found = tree_of(own, told)
    if tree and found != tree:
        raise Conflict(
            "The graphs inside that were sent are not those that were approved: the digest of all "
            f"together is {found[:12]}…, not {tree[:12]}…. Nothing was started.",
            where={"path": "/tree_digest"},
        )
