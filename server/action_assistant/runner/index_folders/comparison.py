"""Compares the graphs inside of a task with the files that an engine indexes. Pure.

A graph is present, lacking, defined differently, or cannot be written. An engine takes the first
file of a name that it finds, in no order, and an action before a graph, so a write that would leave
two definitions is refused.
"""

from collections.abc import Collection, Mapping
from typing import Final, TypeAlias

import msgspec

from action_assistant.runner.index_folders.scan import DefiningFile, IndexedFiles
from action_assistant.safe_text import hold_names
from action_assistant.umrf.check import refused_by_parser
from action_assistant.umrf.digest import digest
from action_assistant.umrf.echo import echo
from action_assistant.umrf.facts import EngineFacts
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph

_NAMED: Final = 5  # paths in one sentence


class Present(msgspec.Struct, frozen=True):
    """The folder has exactly this graph, in a form that engines read."""


class Lacking(msgspec.Struct, frozen=True):
    """No file in the folder defines the graph."""


class Differing(msgspec.Struct, frozen=True):
    """One file in the folder defines another graph of that name, or a graph that no engine reads."""

    file: DefiningFile


class Hindered(msgspec.Struct, frozen=True):
    """The graph cannot be written; `why` is a sentence."""

    why: str

    def __post_init__(self) -> None:
        hold_names(self, "why")


FileState: TypeAlias = Present | Lacking | Differing | Hindered


class WritableGraph(msgspec.Struct, frozen=True):
    """A graph that can be written. `replaces`: the path, in the folder, of the file that it would
    replace; "" for none."""

    graph: str
    replaces: str = ""


class IndexFolderState(msgspec.Struct, frozen=True, kw_only=True):
    """The folder of files that the robot's engine indexes, as the runner sees it. `writable`:
    graphs that can be written there; `waiting`: graphs whose file exists and that the engine has
    not indexed yet; `hindered`: why other graphs cannot be written, as sentences by graph."""

    path: str
    writable: tuple[WritableGraph, ...] = ()
    waiting: tuple[str, ...] = ()
    hindered: dict[str, str] = {}


def same_to_engine(ours: Graph, theirs: Graph, facts: EngineFacts) -> bool:
    """Return whether two graphs are the same to an engine of the build `facts`, which ignores some
    fields."""
    return digest(echo(ours, facts)) == digest(echo(theirs, facts))


def file_state(
    graph: Graph,
    files: IndexedFiles,
    facts: EngineFacts,
    *,
    actions: Collection[str],
    graphs: Mapping[str, Graph],
) -> FileState:
    """Return the state of one graph's file in a folder. `files`: those in it that define names;
    `facts`: the engine build; `actions`, `graphs`: the names in the engine's own index."""
    name = graph.name
    if defining := files.actions.get(name, ()):
        return Hindered(
            f"{_listed(defining)} defines an action {name}, which comes before a graph."
        )
    if name in actions:
        return Hindered(f"It has an action {name}, which comes before a graph.")
    if files.unread:
        unread = "; ".join(files.unread[:_NAMED])
        return Hindered(f"Whether another file defines {name} is not known: {unread}.")
    found = files.graphs.get(name, ())
    if found and all(_is_same(graph, each, facts) for each in found):
        return Present()
    if len(found) > 1:
        return Hindered(
            f"{len(found)} files define {name}, and nobody knows which of them is taken: "
            f"{_listed(found)}. Leave one of them."
        )
    if found:
        return _state_of_other(name, found[0])
    known = graphs.get(name)
    if known is None:
        return Lacking()
    if same_to_engine(graph, known, facts):
        return Present()
    return Hindered(
        f"It has another {name}, of which no file is here: it looks elsewhere, or has not looked since."
    )


def _is_same(graph: Graph, file: DefiningFile, facts: EngineFacts) -> bool:
    """Return whether an engine of the build `facts` would read exactly this graph from the file."""
    try:
        reading = codec.read(file.text)
    except codec.Unreadable:
        return False
    is_read = reading.dialect == "D3" and not refused_by_parser(reading)
    return is_read and same_to_engine(graph, reading.graph, facts)


def _state_of_other(name: str, file: DefiningFile) -> FileState:
    if file.linked:
        return Hindered(
            f"{file.display_path} defines another {name} and is a link, or behind one: what it leads to is not "
            "touched."
        )
    return Differing(file)


def _listed(files: tuple[DefiningFile, ...]) -> str:
    more = f" and {len(files) - _NAMED} more" if len(files) > _NAMED else ""
    return f"{', '.join(each.display_path for each in files[:_NAMED])}{more}"
