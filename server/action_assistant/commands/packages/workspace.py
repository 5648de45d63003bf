"""The source folder of a colcon workspace: what colcon would not take there, before it is written."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from action_assistant.errors import CannotStart

#: Below a folder that has one of them, colcon looks for no packages.
_IGNORED: Final = frozenset({"COLCON_IGNORE", "AMENT_IGNORE"})
_MANIFEST: Final = "package.xml"


def against(source: Path, packages: Iterable[str]) -> tuple[str, ...]:
    """Return sentences about what prevents these packages in a source folder. Raise CannotStart if
    there is no such folder, or one in which colcon finds no packages."""
    if not source.is_dir():
        raise CannotStart(
            f"{source} is no folder. --into wants the source folder of a workspace that is there, as "
            "~/ws/src; --output makes folders."
        )
    for name in sorted(_IGNORED | {_MANIFEST}):
        if (source / name).exists():
            raise CannotStart(f"{source} has a {name}: colcon looks for no packages in it.")
    wanted = frozenset(packages)
    return tuple(
        f"{folder}: is a package “{name}” already, and colcon takes no two of one name."
        for folder, name in _packages(source)
        if name in wanted and os.path.realpath(folder) != os.path.realpath(source / name)
    )


def _packages(source: Path) -> Iterator[tuple[Path, str]]:
    """Yield the folder and name of every package below. As colcon does, follow links to folders,
    and skip hidden folders and folders inside packages."""
    seen: set[str] = set()
    for at, folders, files in os.walk(source, followlinks=True):
        real = os.path.realpath(at)
        if real in seen or not _IGNORED.isdisjoint((*files, *folders)):
            folders.clear()
            continue
        seen.add(real)
        if _MANIFEST in files:
            folders.clear()
            name = _name(Path(at, _MANIFEST))
            if name is not None:
                yield Path(at), name
        folders[:] = sorted(folder for folder in folders if not folder.startswith("."))


def _name(manifest: Path) -> str | None:
    """Return the package name in a manifest; None if it cannot be read, as colcon skips it then,
    too."""
    try:
        name = ElementTree.fromstring(manifest.read_bytes()).findtext("name")
    except (OSError, ElementTree.ParseError):
        return None
    return None if name is None else name.strip()
