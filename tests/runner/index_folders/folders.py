"""Folders that an engine indexes, and graphs written into them, for tests."""

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

import msgspec

from action_assistant.runner.index_folders.writing import WritingOutcome, write
from action_assistant.runner.robots.engine import EngineIndex
from action_assistant.runner.runs.sent_graphs import SentSubgraph
from action_assistant.runner.start.index_writer import IndexWriteRequest, planned
from action_assistant.umrf.digest import digest
from action_assistant.umrf.facts import PINNED
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph


def sent(graph: Graph, **changes: Any) -> SentSubgraph:
    """A graph as a wish carries it."""
    fields: dict[str, Any] = {
        "name": graph.name,
        "digest": digest(graph),
        "umrf": msgspec.Raw(codec.write(graph).encode()),
    }
    return SentSubgraph(**(fields | changes))


def wish(*graphs: Graph, replace: Collection[str] = ()) -> IndexWriteRequest:
    return IndexWriteRequest(
        subgraphs=tuple(map(sent, graphs)), digest="0" * 64, replace=tuple(replace)
    )


def put(
    folder: Path,
    *graphs: Graph,
    replace: Collection[str] = (),
    index: EngineIndex = EngineIndex(),  # noqa: B008 - frozen
) -> WritingOutcome:
    """Plan and write, as the runner does."""
    return write(folder, planned(wish(*graphs, replace=replace), folder, index, PINNED).files)


def add(folder: Path, path: str, graph: Graph) -> Path:
    """The file of a graph, as people keep one."""
    file = folder / path
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(codec.write(graph))
    return file


def held(folder: Path) -> dict[str, bytes | str]:
    """Return everything below a folder by its path: bytes of files, and targets of links."""
    found: dict[str, bytes | str] = {}
    for below, _, files in os.walk(folder):
        for name in files:
            path = Path(below, name)
            found[str(path.relative_to(folder))] = (
                str(path.readlink()) if path.is_symlink() else path.read_bytes()
            )
    return found
