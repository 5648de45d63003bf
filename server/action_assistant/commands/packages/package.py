"""The command `package`: C++ packages of the actions that a file describes, or that a library has."""

import argparse
import difflib
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Final

from action_assistant.commands.client import add_server, running
from action_assistant.commands.packages.folder import PackagesPlan, plan, prevented_in, write_all
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS
from action_assistant.umrf.kept_values import KEEPER_PACKAGE, keeper
from action_assistant.umrf.model import Action
from action_assistant.umrf.packages.bases import BASE_NAME
from action_assistant.umrf.packages.bundling import bundle_files
from action_assistant.umrf.packages.choosing import disagreements, distinct_actions
from action_assistant.umrf.packages.generating import ImpossiblePackage, is_source, package_files
from action_assistant.umrf.packages.naming import NameRefusal, check_names, snake_case
from action_assistant.umrf.packages.regenerating import GeneratedChange


def tell_refusals(root: Path, plan: PackagesPlan) -> None:
    """Print each reason against writing the plan, with its place."""
    for path, reason in plan.barred.items():
        _tell(f"{root / path}: {reason}.")
    for folder, each in plan.regenerations.items():
        for path in each.differing:
            _tell(
                f"{root / folder / path}: is there and differs; nobody knows what it was made from."
            )
        for path, conflicts in each.conflicts.items():
            for conflict in conflicts:
                _tell(
                    f"{root / folder / path}:{conflict.line}: what was changed here by hand and what is "
                    "generated now overlap."
                )
        for path, reason in each.broken.items():
            _tell(
                f"{root / folder / path}: what was changed by hand and what is generated now make no "
                f"readable file together: {reason}"
            )


def tell_refused(plan: PackagesPlan) -> None:
    """Print that nothing was written and, for conflicts in `plan`, what to do about them."""
    _tell("Nothing was written.")
    if any(each.conflicts or each.broken for each in plan.regenerations.values()):
        _tell("Take over by hand what `--diff` shows for these files, and call again.")


def tell_changes(root: Path, plan: PackagesPlan) -> None:
    """Print what writing the plan would change."""
    for path in plan.writes:
        _tell(f"{root / path}: {'would change' if path in plan.there else 'is not there'}.")
    for path in plan.removals:
        _tell(f"{root / path}: is no longer generated, and would be removed.")


def tell_notes(root: Path, plan: PackagesPlan, with_lines: bool) -> None:
    """Print to stderr which files stay on disk although the generator makes another text of them
    now, or none. With `with_lines`, print also how the text that was generated last differs from
    the one generated now: the former is lost once files are written."""
    for folder, each in plan.regenerations.items():
        for path in each.kept:
            _tell(
                f"{root / folder / path}: is no longer generated; it stays, since it was changed."
            )
        for path, change in each.by_hand.items():
            if not is_source(path):
                continue
            _tell(
                f"{root / folder / path}: is yours and stays; what is generated for it is new, to be "
                f"taken over by hand{':' if with_lines else ' (`--diff` shows it).'}"
            )
            if with_lines:
                sys.stderr.writelines(_by_hand(f"{folder}/{path}", change))


def print_difference(plan: PackagesPlan) -> None:
    """Print, like `diff -u`, what would be written after merging or what prevents it. The base
    files are not shown: their changes repeat those of the other files. Changes that people have to
    make by hand follow at the end."""
    shown: dict[str, bytes | None] = {**plan.writes, **dict.fromkeys(plan.removals)}
    for folder, each in plan.regenerations.items():
        shown |= {f"{folder}/{path}": content for path, content in each.differing.items()}
    for path in sorted(path for path in shown if not path.endswith(f"/{BASE_NAME}")):
        there, content = plan.there.get(path), shown[path]
        sys.stdout.writelines(
            _lines(
                there or b"",
                content or b"",
                "/dev/null" if there is None else f"a/{path}",
                "/dev/null" if content is None else f"b/{path}",
            )
        )
    for folder, each in plan.regenerations.items():
        for path, change in each.by_hand.items():
            sys.stdout.writelines(_by_hand(f"{folder}/{path}", change))


def _tell(sentence: str) -> None:
    print(sentence, file=sys.stderr)


def _by_hand(path: str, change: GeneratedChange) -> Iterator[str]:
    return _lines(change.last, change.now, f"{path} as generated last", f"{path} as generated now")


def _lines(before: bytes, after: bytes, old: str, new: str) -> Iterator[str]:
    found = difflib.unified_diff(
        before.decode(errors="replace").splitlines(keepends=True),
        after.decode(errors="replace").splitlines(keepends=True),
        old,
        new,
    )
    return (
        line if line.endswith("\n") else f"{line}\n\\ No newline at end of file\n" for line in found
    )


def _add_package(package: argparse.ArgumentParser) -> None:
    add_server(package, "open_gripper.umrf.json --output ~/ws/src")
    package.add_argument(
        "file",
        type=Path,
        nargs="?",
        metavar="FILE",
        help="of one action, or a graph; without, --name is asked of the library of a running server",
    )
    place = package.add_mutually_exclusive_group(required=True)
    place.add_argument(
        "--output", type=Path, metavar="DIR", help="in which each package has a folder"
    )
    place.add_argument(
        "--into", type=Path, metavar="DIR", help="the same, of a colcon workspace: its src"
    )
    package.add_argument(
        "--name",
        nargs="+",
        metavar="NAME",
        help="of a graph's actions, or of the library's: these only",
    )
    package.add_argument(
        "--values",
        action="store_true",
        help="the package that keeps values, so that runs which the runner leads can hand them on",
    )
    package.add_argument(
        "--together",
        metavar="PACKAGE",
        help="one package of this name with all the actions, instead of one for each",
    )
    package.add_argument(
        "--diff", action="store_true", help="show what would be written, and write nothing"
    )
    package.add_argument(
        "--check", action="store_true", help="write nothing; exit 1 if anything would change"
    )
    package.set_defaults(handler=_package)


COMMANDS: Final = {"package": _add_package}


def _package(options: argparse.Namespace) -> int:
    source = options.file or (KEEPER_PACKAGE if options.values else "library")
    refusals: tuple[NameRefusal, ...] = ()
    try:
        if options.values:
            actions = _keeping(options)
        elif options.file is None:
            actions = _of_library(options)
        else:
            actions, refusals = _chosen(options.file, options.name)
    except codec.Unreadable as error:
        place = f"{options.file}:{error.line}:{error.column}"
        print(f"{place}: {error.message}", file=sys.stderr)
        return 1
    packages, more = _packages(actions, options.together)
    if refusals := (*refusals, *more):
        for refusal in dict.fromkeys(refusals):
            print(f"{source}: {one_line(refusal.sentence)}", file=sys.stderr)
        return 1
    root = options.into or options.output
    duplicates = () if options.into is None else prevented_in(options.into, packages)
    for sentence in duplicates:
        print(one_line(sentence), file=sys.stderr)
    return 1 if duplicates else _regenerated(root, plan(root, packages), options)


def _regenerated(root: Path, found: PackagesPlan, options: argparse.Namespace) -> int:
    writing = not options.diff and not options.check
    tell_refusals(root, found)
    if options.check:
        tell_changes(root, found)
    if writing and not found.refused:
        return _written(root, found)
    tell_notes(root, found, with_lines=False)
    if options.diff:
        print_difference(found)
    if writing:
        tell_refused(found)
    return 1 if found.refused or (options.check and found.steps) else 0


def _keeping(options: argparse.Namespace) -> tuple[Action, ...]:
    """Return the action of the helper package that keeps values, as the only one. Raise CannotStart
    if the options name others, too."""
    if options.file is not None or options.name or options.together:
        raise CannotStart("--values is a package of its own: name no FILE, --name or --together.")
    return (keeper(),)


def _of_library(options: argparse.Namespace) -> tuple[Action, ...]:
    """Return the actions of the library that the options name. Raise RequestRefused for an unknown
    name, CannotStart if none is named or no server is reached."""
    if not options.name:
        raise CannotStart("Which action? Name a FILE, or with --name actions of the library.")
    with running(options) as server:
        listed = server.editor("GET", "/api/actions").json()
        known = {each["name"]: each["document"] for each in reversed(listed) if each["document"]}
        missing = [name for name in options.name if name not in known]
        if missing:
            raise RequestRefused(f"The library has no action {missing[0]!r}.")
        files = [
            server.editor("GET", f"/api/actions/{known[name]}/umrf").text
            for name in dict.fromkeys(options.name)
        ]
    return tuple(codec.read_action(file).action for file in files)


def _chosen(
    path: Path, names: Sequence[str] | None
) -> tuple[tuple[Action, ...], tuple[NameRefusal, ...]]:
    """Return the actions of a file (`path`) for which packages are wanted (`names`, None for all),
    and refusals of actions whose uses disagree. Raise `Unreadable` for a file that is no UMRF,
    CannotStart for one that cannot be read."""
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


def _packages(
    actions: Sequence[Action], together: str | None
) -> tuple[dict[str, dict[str, bytes]], tuple[NameRefusal, ...]]:
    """Return the files of all packages (folder, then path inside the folder, to content), and the
    reasons why no package may be written. If there are reasons, the files are incomplete.
    `together`: the name of one package for all actions; None for one package for each action."""
    if together is not None:
        try:
            return {together: bundle_files(together, actions)}, ()
        except ImpossiblePackage as error:
            return {}, error.refusals
    packages: dict[str, dict[str, bytes]] = {}
    refusals = list(check_names(action.name for action in actions))
    for action in actions:
        try:
            packages[snake_case(action.name)] = package_files(action)
        except ImpossiblePackage as error:
            refusals += error.refusals
    return packages, tuple(refusals)


def _written(root: Path, found: PackagesPlan) -> int:
    write_all(root, found.steps, found.there)
    for path in found.writes:
        print(root / path)
    for path in found.removals:
        print(f"{root / path}: is no longer generated, and was removed.", file=sys.stderr)
    tell_notes(root, found, with_lines=True)
    return 0
