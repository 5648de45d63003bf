"""A graph and those inside of it, made into one graph that does the same, or why there is none. For workers."""

import msgspec
from msgspec.structs import replace

from action_assistant.editor.documents.contents import GraphAtSeq, Inside, graphs_of, read
from action_assistant.errors import Conflict
from action_assistant.umrf.files import codec
from action_assistant.umrf.hierarchy.flattening import FlatOrigin, LeftOut, Unflattenable, flattened
from action_assistant.umrf.hierarchy.reasons import FlatteningReason
from action_assistant.umrf.json.embedded import UmrfGraph


class FlatGraph(msgspec.Struct, frozen=True):
    """A graph with its sub-graphs, flattened into one graph (docs/decisions/069-flatten.md).

    `umrf`: the flat graph, under the same name; null if none is known to do the same, for the
    `reasons`. `origins`: the graph and action from which each action comes. `left_out`: fields that
    are lost.
    """

    seq: int
    umrf: UmrfGraph | None
    origins: tuple[FlatOrigin, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    reasons: tuple[FlatteningReason, ...] = ()


def flat_graph(sight: GraphAtSeq, inside: Inside) -> bytes:
    """Flatten a graph; return JSON of a `FlatGraph`."""
    found = flattened(read(sight).moment.graph, graphs_of(inside))
    if isinstance(found, Unflattenable):
        return msgspec.json.encode(FlatGraph(sight.seq, None, reasons=found.reasons))
    umrf = msgspec.Raw(codec.write(found.graph).encode())
    return msgspec.json.encode(FlatGraph(sight.seq, umrf, found.origins, found.left_out))


def flat_text(sight: GraphAtSeq, inside: Inside, name: str) -> bytes:
    """Return the UMRF of the flat graph under another name; its description names its source. Raise
    Conflict if no flat graph does the same."""
    graph = read(sight).moment.graph
    found = flattened(graph, graphs_of(inside))
    if isinstance(found, Unflattenable):
        raise Conflict(f"One graph would not do the same: {found.reasons[0].message}")
    made_of = f"Made of {graph.name} (change {sight.seq}) and the graphs inside of it."
    described = "\n".join(filter(None, (found.graph.description, made_of)))
    return codec.write(replace(found.graph, name=name, description=described)).encode()
