"""The command `builds`: what colcon's last build said of the library's actions."""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import msgspec

from action_assistant.commands.builds.colcon_log import BuildError, PackageBuild, last_builds
from action_assistant.commands.client import No, add_server, refused, running
from action_assistant.safe_text import one_line
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import read_action
from action_assistant.umrf.packages.naming import snake_case


def _add_builds(builds: argparse.ArgumentParser) -> None:
    add_server(builds, "~/ws")
    builds.add_argument(
        "workspace", type=Path, metavar="DIR", help="in which `colcon build` was called"
    )
    builds.set_defaults(handler=_builds)


COMMANDS: Final = {"builds": _add_builds}


class ActionBuild(msgspec.Struct, frozen=True):
    """How the last build went for one action."""

    action: str
    build: PackageBuild
    errors: tuple[BuildError, ...]


def _builds(options: argparse.Namespace) -> int:
    found = [each for build in last_builds(options.workspace) for each in of_actions(build)]
    if not found:
        print("The last build had no package of an action.", file=sys.stderr)
        return 0
    with running(options) as server:
        try:
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
        except No as error:
            return refused(error)
    return 0 if all(each.build.ended_well for each in found) else 1


def of_actions(build: PackageBuild) -> Iterator[ActionBuild]:
    """What the build of a package means for each action that the package describes. An error in a file
    of one action is that action's; any other is every one's."""
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
    """The actions, in snake case, of which a generated file may be."""
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
