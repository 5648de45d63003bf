"""Sub-graphs: made of chosen actions, unpacked, flattened and packed as files. Runs in workers.

Actions are moved by changes of a document key by key. The page makes these changes, so that they are an edit of
the person's own; `before` lets it see what others changed meanwhile
(docs/decisions/072-make-and-unpack-a-sub-graph.md).
"""

import io
import zipfile
from collections.abc import Iterable
from typing import Final

import msgspec
from msgspec.structs import replace

from action_assistant.editor.documents import document
from action_assistant.editor.documents.contents import GraphAtSeq, Inside, graphs_of, read
from action_assistant.editor.interchange.edited_text import KeyChange, key_changes
from action_assistant.errors import Conflict, NotFound
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.writing import graph_file_name
from action_assistant.umrf.hierarchy.extraction import (
    Extracted,
    Extraction,
    Unpackable,
    extracted,
    unpacked,
)
from action_assistant.umrf.hierarchy.flattening import FlatOrigin, LeftOut, Unflattenable, flattened
from action_assistant.umrf.hierarchy.reasons import FlatteningReason
from action_assistant.umrf.json.text import UmrfGraph
from action_assistant.umrf.model import Key, Position
from action_assistant.umrf.signatures import signature_of

_LONG_AGO: Final = (1980, 1, 1, 0, 0, 0)  # the same files are the same bytes
_MODE: Final = 0o644 << 16


class ChosenActions(msgspec.Struct, frozen=True):
    """The actions to move into a sub-graph, and its name. `taken`: whether something else has that name;
    `otherwise`: do it even if the graph may then behave otherwise."""

    keys: tuple[Key, ...]
    name: str
    taken: bool = False
    otherwise: bool = False


class ExtractionLook(msgspec.Struct, frozen=True):
    """A preview of moving actions into a sub-graph. `umrf`: the sub-graph; null if it is
    impossible, for the `reasons`. `inputs`, `outputs`: types of its parameters by flat name.
    `changes`: of the outer document after `seq`. `differences`: ways in which the graph may
    behave differently."""

    seq: int
    umrf: UmrfGraph | None
    inputs: dict[str, str] = {}
    outputs: dict[str, str] = {}
    changes: tuple[KeyChange, ...] = ()
    differences: tuple[FlatteningReason, ...] = ()
    reasons: tuple[FlatteningReason, ...] = ()


class UnpackingLook(msgspec.Struct, frozen=True):
    """A preview of replacing an action by the actions of the graph `inside`. `changes`: of the
    document after `seq`; empty if it is impossible, for the `reasons`. `actions`: the keys of
    the new actions; `differences`: ways in which the graph may behave differently; `left_out`:
    fields that are lost."""

    seq: int
    inside: str
    changes: tuple[KeyChange, ...] = ()
    actions: tuple[Key, ...] = ()
    differences: tuple[FlatteningReason, ...] = ()
    left_out: tuple[str, ...] = ()
    reasons: tuple[FlatteningReason, ...] = ()


class SubGraphFile(msgspec.Struct, frozen=True):
    """The file of a new sub-graph, the keys of its actions in order, and the JSON of the changes
    that replace these actions by one for the sub-graph."""

    umrf: bytes
    keys: tuple[Key, ...]
    changes: bytes


def extraction_look(sight: GraphAtSeq, chosen: ChosenActions) -> bytes:
    """Preview moving chosen actions of a graph at a change (`sight`) into a sub-graph; return the
    JSON of an `ExtractionLook`."""
    return msgspec.json.encode(_look(sight, _extraction(sight, chosen), chosen))


def subgraph_file(sight: GraphAtSeq, chosen: ChosenActions) -> SubGraphFile:
    """Return the sub-graph that is made of chosen actions, and the changes of the outer document
    that replace these actions by it. `sight`: the outer graph at one change. Raise Conflict if this
    is impossible, or if the graph might then behave differently and `chosen.otherwise` is False."""
    found = _extraction(sight, chosen)
    look = _look(sight, found, chosen)
    for reason in look.reasons:
        raise Conflict(reason.message, where={"code": reason.code})
    assert isinstance(found, Extracted)  # else there are reasons
    for reason in () if chosen.otherwise else look.differences:
        raise Conflict(f"It may do otherwise: {reason.message}", where={"code": reason.code})
    keys = tuple(action.key for action in found.inner.actions)
    return SubGraphFile(msgspec.json.encode(look.umrf), keys, msgspec.json.encode(look.changes))


def _extraction(sight: GraphAtSeq, chosen: ChosenActions) -> Extraction:
    graph = read(sight).moment.graph
    return extracted(graph, frozenset(chosen.keys), chosen.name, document.new_aid())


def _look(sight: GraphAtSeq, found: Extraction, chosen: ChosenActions) -> ExtractionLook:
    moment = read(sight).moment
    if not isinstance(found, Extracted):
        return ExtractionLook(sight.seq, None, reasons=found.reasons)
    if chosen.taken:
        message = f"A graph, or an action of the library, is called “{chosen.name}” already."
        return ExtractionLook(sight.seq, None, reasons=(FlatteningReason("name", message),))
    action = next(a for a in found.outer.actions if a.key == found.key)
    signature = signature_of(action)
    return ExtractionLook(
        sight.seq,
        msgspec.Raw(codec.write(found.inner).encode()),
        signature.inputs,
        signature.outputs,
        tuple(key_changes(moment.maps, moment.graph, found.outer)),
        found.differences,
    )


def unpacking_look(
    sight: GraphAtSeq, action: Key, at: Position | None, inside: GraphAtSeq
) -> bytes:
    """Preview replacing the action with the key `action` by the actions of the graph `inside`;
    return the JSON of an `UnpackingLook`, which has only `reasons` if that is impossible. `sight`:
    the graph with the action; `at`: where the page draws the action, used if the action has no
    stored position."""
    moment = read(sight).moment
    drawn = tuple(
        replace(a, position=a.position or at) if a.key == action else a
        for a in moment.graph.actions
    )
    shown = replace(moment.graph, actions=drawn)
    found = unpacked(shown, action, read(inside).moment.graph)
    look = UnpackingLook(sight.seq, inside.graph)
    if isinstance(found, Unpackable):
        return msgspec.json.encode(replace(look, reasons=found.reasons))
    whole = replace(
        look,
        changes=tuple(key_changes(moment.maps, moment.graph, found.graph)),
        actions=found.keys,
        differences=found.differences,
        left_out=found.left_out,
    )
    return msgspec.json.encode(whole)


def name_of_action(sight: GraphAtSeq, action: Key) -> str:
    """Return the name of the action with this key in a graph at a change (`sight`). Raise NotFound
    if the graph does not have it."""
    for each in read(sight).moment.graph.actions:
        if each.key == action and not each.missing:
            return each.name
    raise NotFound("That action is not there any more.")


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
    """Flatten a graph at a change (`sight`) with the graphs inside; return the JSON of a
    `FlatGraph`."""
    found = flattened(read(sight).moment.graph, graphs_of(inside))
    if isinstance(found, Unflattenable):
        return msgspec.json.encode(FlatGraph(sight.seq, None, reasons=found.reasons))
    umrf = msgspec.Raw(codec.write(found.graph).encode())
    return msgspec.json.encode(FlatGraph(sight.seq, umrf, found.origins, found.left_out))


def flat_text(sight: GraphAtSeq, inside: Inside, name: str) -> bytes:
    """Return the UMRF text of the flat graph of `sight` under another name; its description names
    its source. Raise Conflict if no flat graph does the same."""
    graph = read(sight).moment.graph
    found = flattened(graph, graphs_of(inside))
    if isinstance(found, Unflattenable):
        raise Conflict(f"One graph would not do the same: {found.reasons[0].message}")
    made_of = f"Made of {graph.name} (change {sight.seq}) and the graphs inside of it."
    described = "\n".join(filter(None, (found.graph.description, made_of)))
    return codec.write(replace(found.graph, name=name, description=described)).encode()


def zipped(graphs: Iterable[tuple[str, bytes]]) -> bytes:
    """Return a ZIP file with one file for each graph, given as pairs of name and text. The files
    are named so that an engine indexes them: `*graph.json`."""
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as file:
        taken: set[str] = set()
        for name, text in graphs:
            entry = zipfile.ZipInfo(_free_name(name, taken), _LONG_AGO)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = _MODE
            file.writestr(entry, text)
    return made.getvalue()


def _free_name(graph: str, taken: set[str]) -> str:
    """Return a file name for the graph of this name that is not in `taken`, and add it there in
    lower case, since some file systems ignore case."""
    number = 1
    while (name := graph_file_name(graph, number)).lower() in taken:
        number += 1
    taken.add(name.lower())
    return name
