"""What files of graphs are called, so that an engine indexes them as graphs and as nothing else."""

import re
from typing import Final

#: An engine takes what has this in its name for a graph, and for an action what has the other.
GRAPH_MARK: Final = "graph.json"
ACTION_MARK: Final = "umrf.json"
ENDING: Final = ".umrf.graph.json"
_UNFIT: Final = re.compile(r"[^A-Za-z0-9_.-]+")
_LONGEST: Final = 80


def graph_file_name(graph: str, number: int = 1) -> str:
    """A name that every file system takes, whatever the graph is called. `number` tells those apart that
    would have the same."""
    stem = unmarked(_UNFIT.sub("_", graph)).strip("._")[:_LONGEST] or "graph"
    return f"{stem}{'' if number == 1 else f'-{number}'}{ENDING}"


def unmarked(name: str) -> str:
    """The name without what an engine looks for in names."""
    return name.replace(".json", "_json")
