"""Action libraries in the workspace that is sourced here, and whether they are older than their
sources.

An engine tells which file of an action it has indexed, and nothing about the action's library
(docs/umrf-and-the-engine.md 5). For a workspace on this computer, the folders of colcon tell:
`install/…/lib/libNAME.so`, and in `build/PACKAGE` the library as it was linked and the path of its
source.
"""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Final, NamedTuple

from action_assistant.ros_workspace import source_of
from action_assistant.umrf.model import Graph
from action_assistant.umrf.packages.naming import snake_case

#: Endings of files that a library is compiled from. A change of any other file does not link it anew.
_COMPILED: Final = frozenset({".cpp", ".cc", ".cxx", ".c", ".hpp", ".hh", ".hxx", ".h"})
_ABOVE: Final = 3  # folders between a `lib` and its workspace: install, or install/PACKAGE
_MOST: Final = 2_000  # source files of one package that are compared


class OlderLibrary(NamedTuple):
    """An action's library, and a file of its source that was changed after the library was
    built."""

    action: str
    library: Path
    source: Path


def older_libraries(graph: Graph, prefixes: Sequence[Path]) -> list[OlderLibrary]:
    """Return the outdated libraries of a graph's actions, by name. `prefixes` as in
    AMENT_PREFIX_PATH, the nearest first."""
    names = sorted({action.name for action in graph.actions if not action.missing})
    return [found for name in names if (found := _older(name, prefixes)) is not None]


def _older(name: str, prefixes: Iterable[Path]) -> OlderLibrary | None:
    """Return the outdated library of one action. The first prefix that has the library counts, as
    for the engine's loader."""
    file = f"lib{snake_case(name)}.so"
    for prefix in prefixes:
        installed = prefix / "lib" / file
        if installed.is_file():
            for built in _built(prefix, file):
                if (source := _newer(built)) is not None:
                    return OlderLibrary(name, installed, source)
            return None
    return None


def _built(prefix: Path, file: str) -> Iterator[Path]:
    """Yield the copies of a library in the build folder of the workspace that a prefix belongs
    to."""
    for above in [*prefix.parents][:_ABOVE]:
        found = sorted((above / "build").glob(f"*/{file}"))
        if found:
            yield from found
            return


def _newer(built: Path) -> Path | None:
    """Return the source file of a library that was changed last, if that was after the library was
    linked."""
    home = source_of(built.parent)
    if home is None:
        return None
    linked = built.stat().st_mtime_ns
    newest: tuple[int, Path] | None = None
    for _, path in zip(range(_MOST), _sources(home), strict=False):
        try:
            changed = path.stat().st_mtime_ns, path
        except OSError:
            continue
        newest = changed if newest is None else max(newest, changed)
    return newest[1] if newest is not None and newest[0] > linked else None


def _sources(home: Path) -> Iterator[Path]:
    """Yield the files that a library is compiled from, without those of tests."""
    for path in home.rglob("*"):
        if path.suffix in _COMPILED and "test" not in path.relative_to(home).parts:
            yield path
