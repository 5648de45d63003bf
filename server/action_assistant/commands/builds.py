"""The command `builds`: what colcon's last build said of the library's actions."""

import argparse
import re
import sys
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath
from typing import Any, Final

import msgspec

from action_assistant.commands.client import add_server, running
from action_assistant.errors import CannotStart
from action_assistant.ros_workspace import source_of
from action_assistant.safe_text import one_line
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import read_action
from action_assistant.umrf.packages.naming import snake_case

#: The number of errors reported for one package; later ones mostly follow from the first.
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
    """The result of the last build of one package. `source`: the folder of its source; None if it
    cannot be found."""

    package: str
    ended_well: bool
    at: datetime
    errors: tuple[BuildError, ...]
    source: Path | None


def last_builds(workspace: Path) -> tuple[PackageBuild, ...]:
    """Return the result of every package in the last colcon build of a workspace. Raise CannotStart
    if it has no log of one."""
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
    """Return the errors in `said`, the output of the build of one package. If no line of the output
    is recognised as an error, return one error with the last three lines. `source`: the source
    folder of the package, to which the paths of files in errors are made relative; None if unknown.
    """
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


def _add_builds(builds: argparse.ArgumentParser) -> None:
    add_server(builds, "~/ws")
    builds.add_argument(
        "workspace", type=Path, metavar="DIR", help="in which `colcon build` was called"
    )
    builds.set_defaults(handler=_builds)


COMMANDS: Final = {"builds": _add_builds}


class ActionBuild(msgspec.Struct, frozen=True):
    """The result of the last build for one action."""

    action: str
    build: PackageBuild
    errors: tuple[BuildError, ...]


def _builds(options: argparse.Namespace) -> int:
    found = [each for build in last_builds(options.workspace) for each in of_actions(build)]
    if not found:
        print("The last build had no package of an action.", file=sys.stderr)
        return 0
    with running(options) as server:
        listed = server.editor("GET", "/api/actions").json()
        documents = {each["name"]: each["document"] for each in reversed(listed)}
        for each in found:
            _tell(each)
            document = documents.get(each.action)
            if document is None:
                print(one_line(f"{each.action}: is not in the library."), file=sys.stderr)
                continue
            path = f"/api/actions/{document}/build"
            server.editor("PUT", path, content=msgspec.json.encode(_body(each)))
    return 0 if all(each.build.ended_well for each in found) else 1


def of_actions(build: PackageBuild) -> Iterator[ActionBuild]:
    """Yield the result of a package's build for each action that the package describes.

    An error in a file of one action belongs to that action; any other error belongs to all of them.
    """
    names = {} if build.source is None else dict(_described(build.source))
    for package, name in names.items():
        own = tuple(
            error
            for error in build.errors
            if package in (of := _packages_of(error.file)) or not names.keys() & of
        )
        yield ActionBuild(name, build, own)


def _described(source: Path) -> Iterator[tuple[str, str]]:
    for path in sorted(source.glob("*.umrf.json")):
        try:
            name = read_action(path.read_bytes()).action.name
        except (OSError, codec.Unreadable):
            continue
        yield snake_case(name), name


def _packages_of(file: str) -> frozenset[str]:
    """Return the names in snake case (those of single packages) of actions to which a generated
    file may belong, judged by its path alone. `file`: its path below the built package. Names of no
    action may be among them."""
    parts = file.split("/")
    stem = parts[-1].split(".")[0]
    return frozenset({stem, stem.removesuffix("_test"), *parts[1:2]})


def _body(each: ActionBuild) -> dict[str, Any]:
    return {
        "package": each.build.package,
        "ended_well": each.build.ended_well,
        "at": each.build.at,
        "errors": each.errors,
    }


def _tell(each: ActionBuild) -> None:
    if each.build.ended_well:
        print(one_line(f"{each.action}: built."))
        return
    if not each.errors:
        print(one_line(f"{each.action}: not built, for errors of others in its package."))
    for error in each.errors:
        place = ":".join(str(part) for part in (error.file, error.line, error.column) if part)
        print(
            one_line(
                f"{each.action}: {place}: {error.message}"
                if place
                else f"{each.action}: {error.message}"
            )
        )
