"""Names of files of graphs, by which an engine indexes them as graphs only."""

import re
from typing import Final

#: An engine takes a file with this in its name for a graph, and one with the other for an action.
GRAPH_MARK: Final = "graph.json"
ACTION_MARK: Final = "umrf.json"
ENDING: Final = ".umrf.graph.json"
_UNFIT: Final = re.compile(r"[^A-Za-z0-9_.-]+")
_LONGEST: Final = 80


def graph_file_name(graph: str, number: int = 1) -> str:
    """Return a name that every file system accepts, whatever the graph is called.

    `number` distinguishes graphs that would have the same file name.
    """
    stem = unmarked(_UNFIT.sub("_", graph)).strip("._")[:_LONGEST] or "graph"
    return f"{stem}{'' if number == 1 else f'-{number}'}{ENDING}"


def unmarked(name: str) -> str:
    """Return the name without the marks that an engine looks for."""
    return name.replace(".json", "_json")
