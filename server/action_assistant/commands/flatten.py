"""The command `flatten`: one graph made of a graph and its sub-graphs."""

import argparse
import sys
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from action_assistant.commands.files import actions_below, file_text, refusal
from action_assistant.errors import CannotStart
from action_assistant.safe_text import one_line
from action_assistant.umrf import check as checks
from action_assistant.umrf.files import codec
from action_assistant.umrf.files.action_files import ACTION_DIALECTS
from action_assistant.umrf.hierarchy.flattening import (
    FlatOrigin,
    Flattened,
    LeftOut,
    Unflattenable,
    flattened,
)
from action_assistant.umrf.hierarchy.reasons import FlatteningReason, LevelPath
from action_assistant.umrf.json.text import pointer
from action_assistant.umrf.model import Problem, Where


class GivenGraph(NamedTuple):
    """A graph that was read from a file, and the path of the file."""

    path: Path
    reading: codec.Reading


def given_graph(path: Path) -> GivenGraph:
    """Read the graph of the file `path`. Raise CannotStart if an engine would refuse the file."""
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
    """Return the graphs in files and folders (`paths`), by name; the first of equal names counts.
    In a folder, a file that is no graph is skipped with a message."""
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


class FlattenedFile(msgspec.Struct, frozen=True, tag="flattened", tag_field="kind"):
    """The output of `flatten --json` for a graph that could be made flat."""

    umrf: msgspec.Raw
    origins: tuple[FlatOrigin, ...]
    left_out: tuple[LeftOut, ...]


def _add_flatten(flatten: argparse.ArgumentParser) -> None:
    flatten.epilog = (
        "example: action-assistant flatten patrol.graph.json --with graphs/ > flat.json"
    )
    flatten.add_argument("file", type=Path, metavar="FILE")
    flatten.add_argument(
        "--with",
        type=Path,
        nargs="+",
        default=[],
        dest="graphs",
        metavar="PATH",
        help="files of sub-graphs, or folders of them: *graph.json",
    )
    flatten.add_argument(
        "--actions",
        type=Path,
        metavar="DIR",
        help="of action packages, which come before sub-graphs",
    )
    flatten.add_argument("--output", type=Path, metavar="FILE", help="write it there")
    flatten.add_argument("--json", action="store_true", help="with where each action comes from")
    flatten.set_defaults(handler=_flatten)


COMMANDS: Final = {"flatten": _add_flatten}


def _flatten(options: argparse.Namespace) -> int:
    """Run the command with these options; return the exit code, 1 if no single graph does the same
    as the hierarchy."""
    top = given_graph(options.file)
    given = given_graphs(options.graphs)
    known = actions_below(options.actions).keys() if options.actions else frozenset[str]()
    graphs = {name: each.reading.graph for name, each in given.items()}
    found = flattened(top.reading.graph, graphs, known)
    match found:
        case Unflattenable(reasons=reasons):
            for reason in reasons:
                print(one_line(_told(reason, top, given)), file=sys.stderr)
            if options.json:
                _print_json(found)
            return 1
        case Flattened(graph=graph, origins=origins, left_out=left_out):
            text = codec.write(graph)
            for each in left_out:
                what = f"{', '.join(each.fields)} of {_path(each.levels)} left out"
                print(one_line(f"{options.file}: {what}"), file=sys.stderr)
            if options.output:
                _write(options.output, text)
            if options.json:
                _print_json(FlattenedFile(msgspec.Raw(text.encode()), origins, left_out))
            elif not options.output:
                sys.stdout.write(text)
            return 0


def _told(reason: FlatteningReason, top: GivenGraph, given: Mapping[str, GivenGraph]) -> str:
    """Return a line with a reason and the place of its action in the file of its graph. `top`: the
    outer graph; `given`: the others by name."""
    if not reason.at:
        return f"{top.path}: {reason.message} ({reason.code})"
    last = reason.at[-1]
    file = top if len(reason.at) == 1 else given[_name_of(reason.at[-2].action)]
    actions = [action for action in file.reading.graph.actions if not action.missing]
    number = next((n for n, action in enumerate(actions) if action.key == last.key), None)
    place = str(file.path)
    if number is not None:
        where = Where(path=pointer("actions", number, "name"), aid=last.key)
        problem = Problem(code=reason.code, severity="error", where=where, message="")
        (placed,) = file.reading.placed([problem])
        place += f":{placed.where.line}:{placed.where.column}"
    return f"{place}: {_path(reason.at)}: {reason.message} ({reason.code})"


def _name_of(full_name: str) -> str:
    return full_name.rpartition("_")[0]


def _path(levels: LevelPath) -> str:
    return " > ".join(level.action for level in levels)


def _print_json(found: FlattenedFile | Unflattenable) -> None:
    sys.stdout.write(msgspec.json.format(msgspec.json.encode(found)).decode() + "\n")


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise CannotStart(f"Cannot write {path}: {error.strerror}.") from error
