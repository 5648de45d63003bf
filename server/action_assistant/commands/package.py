"""The command `package`: C++ packages of the actions that a file describes."""

import argparse
import difflib
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from action_assistant.commands.package_folder import FolderComparison, compared, write_new
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS
from action_assistant.umrf.model import Action
from action_assistant.umrf.packages.choosing import disagreements, distinct_actions
from action_assistant.umrf.packages.generating import ImpossiblePackage, package_files
from action_assistant.umrf.packages.naming import NameRefusal, check_names, snake_case


def _add_package(package: argparse.ArgumentParser) -> None:
    package.epilog = "example: action-assistant package open_gripper.umrf.json --output ~/ws/src"
    package.add_argument("file", type=Path, metavar="FILE", help="of one action, or a graph")
    package.add_argument(
        "--output",
        type=Path,
        required=True,
        metavar="DIR",
        help="in which each package has a folder",
    )
    package.add_argument(
        "--name", nargs="+", metavar="NAME", help="of a graph's actions: these only"
    )
    package.add_argument(
        "--diff", action="store_true", help="show what would change, and write nothing"
    )
    package.add_argument(
        "--check", action="store_true", help="write nothing; exit 1 if anything would change"
    )
    package.set_defaults(handler=_package)


COMMANDS: Final = {"package": _add_package}


def _package(options: argparse.Namespace) -> int:
    try:
        actions, refusals = _chosen(options.file, options.name)
    except codec.Unreadable as error:
        place = f"{options.file}:{error.line}:{error.column}"
        print(f"{place}: {error.message}", file=sys.stderr)
        return 1
    files, more = _files(actions)
    if refusals := (*refusals, *more):
        for refusal in dict.fromkeys(refusals):
            print(f"{options.file}: {one_line(refusal.sentence)}", file=sys.stderr)
        return 1
    found = compared(options.output, files)
    if options.diff:
        _print_difference(files, found)
    if options.check:
        return _checked(options.output, found)
    if options.diff:
        return 1 if _told_barred(options.output, found) else 0
    return _written(options.output, files, found)


def _chosen(
    path: Path, names: Sequence[str] | None
) -> tuple[tuple[Action, ...], tuple[NameRefusal, ...]]:
    """The actions that packages are asked for. Raises `Unreadable`, and CannotStart for no file."""
    try:
        text = path.read_bytes()
    except OSError as error:
        raise CannotStart(f"Cannot read {path}: {error.strerror}.") from error
    reading = codec.read(text)
    if reading.dialect in ACTION_DIALECTS:
        actions: tuple[Action, ...] = (codec.read_action(text).action,)
        differing: tuple[NameRefusal, ...] = ()
    else:
        actions, differing = distinct_actions(reading.graph), disagreements(reading.graph)
    wanted = {action.name for action in actions} if names is None else set(names)
    unknown = sorted(wanted - {action.name for action in actions})
    if not actions:
        differing = (NameRefusal("actions", "The file has no action."),)
    return (
        tuple(action for action in actions if action.name in wanted),
        (
            *(NameRefusal(name, "The file has no action of this name.") for name in unknown),
            *(refusal for refusal in differing if refusal.place in {*wanted, "actions"}),
        ),
    )


def _files(actions: Sequence[Action]) -> tuple[dict[str, bytes], tuple[NameRefusal, ...]]:
    """All files of all packages, each below the folder of its own; or what stands against them."""
    files: dict[str, bytes] = {}
    refusals = list(check_names(action.name for action in actions))
    for action in actions:
        try:
            made = package_files(action)
        except ImpossiblePackage as error:
            refusals += error.refusals
        else:
            folder = snake_case(action.name)
            files |= {f"{folder}/{path}": content for path, content in made.items()}
    return files, tuple(refusals)


def _told_barred(root: Path, found: FolderComparison) -> bool:
    for path, reason in found.barred.items():
        print(f"{root / path}: {reason}.", file=sys.stderr)
    return bool(found.barred)


def _checked(root: Path, found: FolderComparison) -> int:
    barred = _told_barred(root, found)
    for path in found.missing:
        print(f"{root / path}: is not there.", file=sys.stderr)
    for path in found.changed:
        print(f"{root / path}: differs.", file=sys.stderr)
    return 1 if barred or found.missing or found.changed else 0


def _written(root: Path, files: Mapping[str, bytes], found: FolderComparison) -> int:
    barred = _told_barred(root, found)
    for path in found.changed:
        print(f"{root / path}: is there and differs; `--diff` shows how.", file=sys.stderr)
    if barred or found.changed:
        print("Nothing was written.", file=sys.stderr)
        return 1
    write_new(root, {path: files[path] for path in found.missing})
    for path in found.missing:
        print(root / path)
    return 0


def _print_difference(files: Mapping[str, bytes], found: FolderComparison) -> None:
    """As `diff -u` prints it; files that are not there are compared with `/dev/null`."""
    for path in sorted({*found.missing, *found.changed}):
        there = found.changed.get(path)
        lines = difflib.unified_diff(
            (there or b"").decode(errors="replace").splitlines(keepends=True),
            files[path].decode().splitlines(keepends=True),
            "/dev/null" if there is None else f"a/{path}",
            f"b/{path}",
        )
        for line in lines:
            sys.stdout.write(
                line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n"
            )
