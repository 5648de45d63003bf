"""The graphs inside of a graph as files, named so that an engine indexes them: `*graph.json`. Pure."""

import io
import zipfile
from collections.abc import Iterable
from typing import Final

from action_assistant.umrf.files.file_names import graph_file_name

_LONG_AGO: Final = (1980, 1, 1, 0, 0, 0)  # the same files are the same bytes
_MODE: Final = 0o644 << 16


def packed(graphs: Iterable[tuple[str, bytes]]) -> bytes:
    """Return a ZIP file with one file for each of these graphs, given by name and text."""
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
    """Return a file name that is not taken, also where a file system ignores case."""
    number = 1
    while (name := graph_file_name(graph, number)).lower() in taken:
        number += 1
    taken.add(name.lower())
    return name
