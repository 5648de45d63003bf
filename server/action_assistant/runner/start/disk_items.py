"""All that an answering robot is looked at for, and what this computer's disk says of it: whether libraries are
as old as their sources, and whether graphs can be written that the robot lacks. For workers.
"""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

import msgspec

from action_assistant.runner.index_folders.comparison import (
    Differing,
    FolderLook,
    Hindered,
    Lacking,
    There,
    WritableGraph,
)
from action_assistant.runner.index_folders.scan import scanned, shown_path
from action_assistant.runner.runs.sent_graphs import graphs_in
from action_assistant.runner.start.admission import Prepared
from action_assistant.runner.start.built_libraries import older_libraries
from action_assistant.runner.start.preflight import EngineView, Item, of_robot
from action_assistant.runner.start.subgraph_items import of_index, of_inside, unlike
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph


def looked_at(view: EngineView, ready: Prepared, prefixes: Sequence[Path]) -> tuple[Item, ...]:
    """Every item of this start. `prefixes`: of the workspace that is sourced here."""
    graph, pinned = codec.read(ready.umrf).graph, graphs_in(ready.subgraphs)
    return (
        *of_robot(view, graph),
        *_built(view, graph, prefixes),
        *(_with_folder(each, view, pinned) for each in of_inside(view, pinned)),
    )


def _built(view: EngineView, graph: Graph, prefixes: Sequence[Path]) -> tuple[Item, ...]:
    """No library of its actions is older than its source, as far as this computer has the workspace."""
    older = older_libraries(graph, prefixes)
    if not older:
        return ()
    first = older[0]
    more = f" (and {len(older) - 1} more)" if len(older) > 1 else ""
    text = (
        f"{first.library.name} in the workspace that is sourced here is older than "
        f"{first.source.name}{more}: {view.name} would run {first.action} as it was before. Call "
        "`colcon build` and restart its engine."
    )
    codes = ("older-library",)
    return (Item(code="built", verdict="blocked", text=text, codes=codes, overridable=True),)


def _with_folder(item: Item, view: EngineView, pinned: Mapping[str, Graph]) -> Item:
    """The item with what could be done about it where the runner has the folder itself."""
    if item.verdict != "blocked" or view.index_folder is None:
        return item
    folder = view.index_folder
    lacking, other = unlike(view, pinned)
    files = scanned(folder, pinned.keys())
    writable: list[WritableGraph] = []
    waiting: list[str] = []
    hindered: dict[str, str] = {}
    for name in sorted(pinned):  # all of them are written or none
        match of_index(pinned[name], files, view.index, view.facts):
            case There():
                waiting += [name] if name in lacking or name in other else []
            case Lacking():
                writable.append(WritableGraph(name))
            case Differing(file):
                writable.append(WritableGraph(name, file.shown))
            case Hindered(why):
                hindered[name] = why
    if writable and not os.access(folder, os.W_OK | os.X_OK):
        why = f"The runner may not write into {shown_path(str(folder))}."
        hindered |= {each.graph: why for each in writable}
        writable = []
    look = FolderLook(
        path=shown_path(str(folder)),
        writable=tuple(writable),
        waiting=tuple(waiting),
        hindered=hindered,
    )
    return msgspec.structs.replace(item, folder=look)
