"""The graphs that a start carries: as requests send them, as they are recorded and as answers show them.

A graph in a body is a JSON object, or a string that holds the text of the object. JavaScript cannot put
a JSON text into another one, and writes `5.0` as `5` after it has read it; a string passes unchanged
(docs/decisions/048-umrf-as-text.md). Graphs inside are sent by value, as the version has them, and
proven by their digests (docs/decisions/070-one-truth-for-sub-graphs.md).
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Final, TypeAlias

import msgspec

from action_assistant.errors import BadInput, Conflict, NotUmrf, Refused, TooLarge
from action_assistant.runner.links.parameter_texts import sent
from action_assistant.runner.runs.events import Requested, RunSubgraph
from action_assistant.umrf.digest import digest, tree_digest
from action_assistant.umrf.files import codec
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.umrf.model import Graph
from action_assistant.umrf.run_size import MOST_BYTES, MOST_INSIDE

#: Bytes of a body that carries graphs: their texts, and everything else of a start.
MOST: Final = MOST_BYTES + 100_000

SentGraph: TypeAlias = Annotated[
    msgspec.Raw,
    msgspec.Meta(
        extra_json_schema={
            "description": "The UMRF graph itself, as approved, or a string that holds its JSON text",
            "anyOf": [{"type": "object", "additionalProperties": True}, {"type": "string"}],
        }
    ),
]


def counted(body: bytes) -> int:
    """Return the length of a request's body without its backslashes. That is a lower bound of the
    length of a graph that is sent as a JSON string, and so with escapes."""
    return len(body) - body.count(b"\\")


def read_sent(umrf: bytes) -> tuple[bytes, codec.Reading]:
    """Return the exact text of a sent graph, and the parsed graph. `umrf`: JSON, the graph itself
    or a string with its text. Parsing is slow: call it in a worker process. Raise BadInput, NotUmrf
    or TooLarge, with the place, if it cannot be read."""
    text = _text_of(umrf)
    if len(text) > MOST_BYTES:
        raise TooLarge(
            f"A graph that is sent has at most {MOST_BYTES // 1_000_000} MB; this one has {len(text):,} bytes."
        )
    try:
        return text, codec.read(text)
    except codec.Unreadable as wrong:
        where: dict[str, object] = {"path": f"/umrf{wrong.path}"}
        if text is umrf:
            raise NotUmrf(wrong.message, where=where) from wrong
        kind = BadInput if wrong.code == "not-json" else NotUmrf
        where |= {"line": wrong.line, "column": wrong.column}
        raise kind(wrong.message, where=where) from wrong


def _text_of(umrf: bytes) -> bytes:
    if not umrf.startswith(b'"'):
        return umrf
    try:
        return msgspec.json.decode(umrf, type=str).encode()
    except msgspec.DecodeError as wrong:
        raise BadInput(f"The string is no text: {wrong}", where={"path": "/umrf"}) from wrong


class SentSubgraph(msgspec.Struct, frozen=True, kw_only=True):
    """A graph inside of the sent one. `name`: of the actions that stand for it; `version`, `graph`:
    its source."""

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
    """Return the sub-graphs of a sent graph in the form in which they are recorded, and parsed by
    name. `sent`: the sub-graphs; `own`: the digest of the graph around them; `tree`: the digest of
    all together, None or "" if unknown. Digests may be missing unless `approved`. Call it in a
    worker process. Raise BadInput, NotUmrf, TooLarge or Conflict, with the place, if one is wrong.
    """
    if len(sent) > MOST_INSIDE:
        raise TooLarge(f"A graph that is sent has at most {MOST_INSIDE} graphs inside.")
    recorded: list[RunSubgraph] = []
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
        recorded.append(RunSubgraph(each.name, each.version, found, text.decode(), each.graph))
    _require_tree(recorded, own, tree)
    return tuple(recorded), graphs


def graphs_in(subgraphs: Sequence[RunSubgraph]) -> dict[str, Graph]:
    """Return the recorded sub-graphs, parsed, by name; unreadable ones are missing. Call it in a
    worker process."""
    found: dict[str, Graph] = {}
    for each in subgraphs:
        try:
            found[each.name] = codec.read(each.umrf.encode()).graph
        except codec.Unreadable:
            continue
    return found


def tree_of(own: str, subgraphs: Sequence[RunSubgraph]) -> str:
    """Return the digest of a graph together with its sub-graphs. `own`: the digest of the graph
    alone."""
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


def _require_tree(recorded: Sequence[RunSubgraph], own: str, tree: str | None) -> None:
    found = tree_of(own, recorded)
    if tree and found != tree:
        raise Conflict(
            "The graphs inside that were sent are not those that were approved: the digest of all "
            f"together is {found[:12]}…, not {tree[:12]}…. Nothing was started.",
            where={"path": "/tree_digest"},
        )


class SubgraphShown(msgspec.Struct, frozen=True):
    """A graph inside of the started one, as it was sent along. `name`: of the actions that stand
    for it; `graph`: its id; `version`: its version, null if none was named."""

    name: str
    version: str | None
    digest: str
    umrf: UmrfGraph
    graph: str | None


class Sent(msgspec.Struct, frozen=True):
    """A graph that was sent, the values of its actions (by full name and flat name, as texts), and
    the graphs inside."""

    umrf: str
    values: dict[str, dict[str, str]]
    subgraphs: tuple[RunSubgraph, ...] = ()
    tree_digest: str | None = None


def sent_of(start: Requested) -> Sent:
    """Read the graph of an accepted start, with its values and sub-graphs. Call it in a worker
    process."""
    return Sent(start.umrf, sent(start.umrf), start.subgraphs, start.tree_digest)


def subgraphs_shown(subgraphs: Sequence[RunSubgraph]) -> list[SubgraphShown]:
    """Return the recorded sub-graphs of a sent graph as the API shows them."""
    return [
        SubgraphShown(
            each.name, each.version, each.digest, msgspec.Raw(each.umrf.encode()), each.graph
        )
        for each in subgraphs
    ]
