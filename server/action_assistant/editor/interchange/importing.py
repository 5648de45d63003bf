"""Reads files that people import into the content of a document. Runs in workers."""

from typing import Any

import msgspec
from msgspec.structs import replace

from action_assistant.editor.crdt.document_quota import (
    refuse_too_long,
    refuse_too_much,
    refuse_too_wide,
)
from action_assistant.editor.documents import document
from action_assistant.editor.documents.contents import (
    NOTHING_INSIDE,
    GraphInfo,
    Inside,
    graphs_of,
    info_of,
    uses_of,
)
from action_assistant.editor.interchange import document_edits
from action_assistant.errors import BadInput, NotUmrf, TooLarge
from action_assistant.umrf.check import check
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS
from action_assistant.umrf.hierarchy.inlining import under_keys
from action_assistant.umrf.model import Graph, Key, Note, Problem


class ImportReport(msgspec.Struct, frozen=True):
    """A report on an imported file: its dialect, the notes on what was translated, and its
    problems.

    `remarks`: the notes with their places; all places are in the file as it was sent.
    """

    dialect: str
    notes: tuple[str, ...]
    problems: tuple[Problem, ...]
    remarks: tuple[Note, ...] = ()


class Preview(msgspec.Struct, frozen=True):
    """The graph that importing a file would make. `problems`: those of the file, then those of the
    graph. `remarks`: the notes with their places; all places are in the file as it was sent."""

    dialect: str
    notes: tuple[str, ...]
    problems: tuple[Problem, ...]
    name: str
    actions: int
    remarks: tuple[Note, ...] = ()


class Pieces(msgspec.Struct, frozen=True):
    """A UMRF text as keys and values of a document. `notes`: what was translated; `remarks`: the
    notes with their places in the text."""

    dialect: str
    notes: tuple[str, ...]
    name: str
    actions: dict[str, Any]
    relations: dict[str, Any]
    positions: dict[str, Any]
    remarks: tuple[Note, ...] = ()


class ImportedFile(msgspec.Struct, frozen=True):
    """A file as the first update of a document. `reading` is JSON of a `ImportReport`."""

    dialect: str
    notes: tuple[str, ...]
    reading: bytes
    update: bytes
    about: GraphInfo


def imported(body: bytes, keys: tuple[Key, ...] = ()) -> ImportedFile:
    """Return what is stored of a UMRF file. `keys`: the keys of its actions in order; without them
    actions get new ones. Raise BadInput, NotUmrf or TooLarge, with the place, for a file that
    cannot be imported."""
    found = fitting(read_graph(body))
    named = dict(zip((action.key for action in found.graph.actions), keys, strict=False))
    update = document_edits.first(under_keys(_directed(found.graph), named))
    refuse_too_long(update)
    told = ImportReport(found.dialect, found.notes, found.problems, found.remarks)
    about = info_of(found.graph, check(found.graph))
    return ImportedFile(found.dialect, found.notes, msgspec.json.encode(told), update, about)


def names(body: bytes) -> tuple[str, tuple[str, ...]]:
    """Return the name of the graph in a file, and the names of its actions. Raise BadInput, NotUmrf
    or TooLarge for a file that cannot be read."""
    graph = read(body).graph
    return graph.name, uses_of(graph)


def preview(body: bytes, inside: Inside = NOTHING_INSIDE) -> bytes:
    """Return the JSON of the `Preview` of a file. `inside`: the graphs that its actions stand for,
    for the checks. Raise BadInput, NotUmrf or TooLarge, with the place, for a file that cannot be
    imported."""
    found = fitting(read_graph(body))
    graph = found.graph
    own = check(graph, graphs=graphs_of(inside), resolution=inside.resolution)
    problems = (*found.problems, *found.placed(own))
    actions = sum(not action.missing for action in graph.actions)
    return msgspec.json.encode(
        Preview(found.dialect, found.notes, problems, graph.name, actions, found.remarks)
    )


def pieces(body: bytes) -> bytes:
    """Return the JSON of `Pieces` for a UMRF text. Raise BadInput, NotUmrf or TooLarge, with the
    place, for a text that cannot be imported."""
    found = fitting(read(body))
    maps = document.flatten(document.with_aids(found.graph))
    return msgspec.json.encode(
        Pieces(
            found.dialect,
            found.notes,
            found.graph.name,
            maps["actions"],
            maps["relations"],
            maps["positions"],
            found.remarks,
        )
    )


def read_graph(body: bytes) -> codec.Reading:
    """Read the UMRF file of a graph. Raise BadInput, NotUmrf or TooLarge, with the place, for any
    other file."""
    found = read(body)
    if found.dialect in ACTION_DIALECTS:
        raise NotUmrf(
            f"This is the file of one action, {found.graph.name or 'without a name'}, and not of a "
            "graph. To draw with the action, open a graph and paste the text of the file there; "
            "“action-assistant convert” makes a graph of this action alone.",
            where={"code": "action-file", "line": 1, "column": 1},
        )
    return found


def _directed(graph: Graph) -> Graph:
    """Return the graph with a direction for its layout; a graph whose actions have positions keeps
    its own."""
    placed = any(action.position is not None for action in graph.actions)
    return graph if placed else replace(graph, direction="right")


def fitting(found: codec.Reading) -> codec.Reading:
    """Return the graph as read from a file. Raise TooLarge if a document cannot hold it."""
    refuse_too_much(found.graph, found.dialect)
    refuse_too_wide(document.flatten(document.with_aids(found.graph)))
    return found


def read(body: bytes) -> codec.Reading:
    """Read the file of a UMRF graph, or of one UMRF action. Raise NotUmrf if the JSON is no UMRF,
    TooLarge if a limit is exceeded, BadInput for other faults; the error has the place of the
    fault (line, column, JSON pointer) where it is known."""
    try:
        return codec.read(body)
    except codec.Unreadable as error:
        where: dict[str, object] = {
            key: value
            for key, value in (
                ("path", error.path),
                ("line", error.line),
                ("column", error.column),
                ("code", error.code),
            )
            if value not in {None, ""}
        }
        kind = {"not-umrf": NotUmrf, "too-large": TooLarge}.get(error.code, BadInput)
        raise kind(error.message, where=where) from error
