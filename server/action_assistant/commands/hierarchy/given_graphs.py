"""Files of graphs that can be sub-graphs of another, as a command is given them."""

import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import NamedTuple

from action_assistant.commands.files import file_text, refusal
from action_assistant.errors import CannotStart
from action_assistant.umrf import check as checks
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS


class GivenGraph(NamedTuple):
    """One file, read."""

    path: Path
    reading: codec.Reading


def given_graph(path: Path) -> GivenGraph:
    """The graph of a file. Raises CannotStart for one that an engine would not take either."""
    try:
        reading = codec.read(file_text(path))
    except codec.Unreadable as error:
        raise CannotStart(refusal(path, error)) from error
    if reading.dialect in ACTION_DIALECTS:
        raise CannotStart(f"{path} is the file of an action, and no graph.")
    if refusals := checks.refused_by_parser(reading):
        raise CannotStart(f"{path}: the engine refuses it: {refusals[0].message}")
    return GivenGraph(path, reading)


def given_graphs(paths: Iterable[Path]) -> dict[str, GivenGraph]:
    """The graphs of files and of folders, by name; of two with one name the first counts. A file of a
    folder that is no graph is left out, and that is said."""
    found: dict[str, GivenGraph] = {}
    for path in paths:
        for given in _below(path) if path.is_dir() else [given_graph(path)]:
            found.setdefault(given.reading.graph.name, given)
    return found


def _below(folder: Path) -> Iterator[GivenGraph]:
    for path in sorted(folder.rglob("*graph.json")):
        try:
            yield given_graph(path)
        except CannotStart as error:
            print(f"left out {error}", file=sys.stderr)
