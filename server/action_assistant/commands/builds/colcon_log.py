"""The log of colcon's last build in a workspace, read: how each package ended, and its errors with
their places. Nothing is run.

Layout (colcon-core 0.20): `log/latest_build/events.log` has a line of each event, `PACKAGE/stderr.log`
what was said of a package, and the cache of CMake in `build/PACKAGE` says where its source lies.
"""

import re
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Final

import msgspec

from action_assistant.errors import CannotStart
from action_assistant.ros_workspace import source_of

#: Of one package; what comes after the first errors is mostly their consequence.
MOST_ERRORS: Final = 50
_LONGEST: Final = 500  # characters of a message
_MOST_BYTES: Final = 4_000_000  # of a log
_ENDED: Final = re.compile(
    r"^\[[\d.]+\] \(([^)]+)\) JobEnded: \{.*'rc': (?:'([A-Z]+)'|(-?\d+))\}$", re.MULTILINE
)
_COMPILER: Final = re.compile(
    r"^(?P<file>[^\s:][^:\n]*):(?P<line>\d+):(?:(?P<column>\d+):)? (?:fatal )?error: (?P<message>.+)$",
    re.MULTILINE,
)
_CMAKE: Final = re.compile(
    r"^CMake Error at (?P<file>[^:\n]+):(?P<line>\d+) \([^)]*\):\n(?P<message>(?:  .*\n|\n(?=  ))+)",
    re.MULTILINE,
)


class BuildError(msgspec.Struct, frozen=True):
    """An error of a compiler or of CMake. `file` is below the package, "" where none was named; `line`
    and `column` are from 1."""

    message: str
    file: str = ""
    line: int | None = None
    column: int | None = None


class PackageBuild(msgspec.Struct, frozen=True):
    """How the last build of a package ended. `source`: the folder of its source, None if it is not
    known any more."""

    package: str
    ended_well: bool
    at: datetime
    errors: tuple[BuildError, ...]
    source: Path | None


def last_builds(workspace: Path) -> tuple[PackageBuild, ...]:
    """Every package of the last build. Raises CannotStart where there is no such log."""
    latest = workspace / "log" / "latest_build"
    events = latest / "events.log"
    try:
        text = _text(events)
        at = datetime.fromtimestamp(events.stat().st_mtime, UTC)
    except OSError as error:
        raise CannotStart(
            f"Cannot read {events}: {error.strerror}. Call `colcon build` in {workspace}."
        ) from error
    return tuple(
        _build(workspace, latest, package, code == "0" and not signal, at)
        for package, signal, code in _ENDED.findall(text)
    )


def _build(
    workspace: Path, latest: Path, package: str, ended_well: bool, at: datetime
) -> PackageBuild:
    source = source_of(workspace / "build" / package)
    if ended_well:
        return PackageBuild(package, True, at, (), source)
    try:
        said = _text(latest / package / "stderr.log")
    except OSError:
        said = ""
    return PackageBuild(package, False, at, errors_of(said, source), source)


def errors_of(said: str, source: Path | None) -> tuple[BuildError, ...]:
    """The errors in what was said of a package; if none is known to be one, its last words."""
    found = list(dict.fromkeys(_errors(said, source)))
    if not found:
        lines = [line.strip() for line in said.splitlines() if line.strip()]
        last = " ".join(lines[-3:]) or "colcon wrote nothing about it."
        return (BuildError(last[:_LONGEST]),)
    return tuple(found[:MOST_ERRORS])


def _errors(said: str, source: Path | None) -> Iterator[BuildError]:
    for pattern in (_CMAKE, _COMPILER):
        for each in pattern.finditer(said):
            column = each["column"] if "column" in pattern.groupindex else None
            yield BuildError(
                " ".join(each["message"].split())[:_LONGEST],
                _below(each["file"], source),
                int(each["line"]),
                None if column is None else int(column),
            )


def _below(file: str, source: Path | None) -> str:
    if source is not None and PurePosixPath(file).is_relative_to(source):
        return PurePosixPath(file).relative_to(source).as_posix()
    return file


def _text(path: Path) -> str:
    with path.open("rb") as file:
        return file.read(_MOST_BYTES).decode(errors="replace")
