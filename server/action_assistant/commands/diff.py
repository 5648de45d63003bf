"""The command `diff`: what differs between two graphs, from files or from a server."""

import argparse
import sys
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

from action_assistant.commands.client import Server, add_server, running
from action_assistant.commands.files import file_text, refusal
from action_assistant.errors import CannotStart, RequestRefused
from action_assistant.safe_text import one_line
from action_assistant.umrf.difference import Difference, difference
from action_assistant.umrf.difference_text import by_name, is_same, lines, without_looks
from action_assistant.umrf.files import codec
from action_assistant.umrf.model import Graph


def _add_diff(diff: argparse.ArgumentParser) -> None:
    add_server(diff, "patrol.umrf.graph.json patrol@120")
    diff.add_argument("before", metavar="A", help="a file, GRAPH or GRAPH@CHANGE, or a version")
    diff.add_argument("after", metavar="B", help="the same")
    diff.add_argument("--json", action="store_true", help="as JSON, for programs")
    diff.add_argument(
        "--without-looks", action="store_true", help="only what means something to a robot"
    )
    diff.set_defaults(handler=_diff)


COMMANDS: Final = {"diff": _add_diff}


class _Moment(NamedTuple):
    """A graph of the server after its change `seq`; None for its newest state."""

    graph: str
    seq: int | None


class _Version(msgspec.Struct):
    """A published version, with the fields that a comparison needs."""

    id: str
    umrf: msgspec.Raw


def _diff(options: argparse.Namespace) -> int:
    """Run the command with these options; return 0 if the two are equal, 1 if they differ. Raise
    CannotStart (exit code 2) if one cannot be read."""
    given = [options.before, options.after]
    try:
        if all(Path(each).is_file() for each in given):
            found = _of_texts(*((each, file_text(Path(each))) for each in given))
        else:
            with running(options) as server:
                found = _on_server(server, given)
    except RequestRefused as error:
        raise CannotStart(str(error)) from error  # exit 2: 1 is for what differs
    if options.without_looks:
        found = without_looks(found)
    if options.json:
        sys.stdout.write(msgspec.json.format(msgspec.json.encode(found)).decode() + "\n")
    else:
        for line in lines(found):
            print(one_line(line))
    return 0 if is_same(found) else 1


def _on_server(server: Server, given: list[str]) -> Difference:
    places = [each if Path(each).is_file() else _place(server, each) for each in given]
    match places:
        case [_Moment(graph, seq) as before, _Moment() as after] if graph == after.graph and seq:
            query = {"from": before.seq} | ({"to": after.seq} if after.seq else {})
            answer = server.editor("GET", f"/api/graphs/{graph}/diff", params=query)
            return msgspec.json.decode(answer.content, type=Difference)
        case _:
            return _of_texts(*(_fetched(server, each) for each in places))


def _place(server: Server, asked: str) -> _Moment | _Version:
    """Parse an argument of the command: a graph, `GRAPH@SEQ`, or a version, which is fetched with
    its UMRF. Raise RequestRefused if the server has none of these."""
    name, at, seq = asked.rpartition("@")
    try:
        if at and seq.isdecimal():
            return _Moment(server.graph_id(name), int(seq))
        return _Moment(server.graph_id(asked), None)
    except RequestRefused:
        try:
            answer = server.editor("GET", f"/api/versions/{asked}")
        except RequestRefused:
            raise RequestRefused(f"{asked!r} is no file, no graph and no version.") from None
        return msgspec.json.decode(answer.content, type=_Version)


def _fetched(server: Server, place: str | _Moment | _Version) -> tuple[str, bytes]:
    """Return the name and the UMRF text of one side of a comparison: a path of a file, a graph or a
    version."""
    match place:
        case str():
            return place, file_text(Path(place))
        case _Moment(graph, seq):
            query = {} if seq is None else {"at": seq}
            answer = server.editor("GET", f"/api/graphs/{graph}/umrf", params=query)
            return graph, answer.content
        case _Version(id=name, umrf=text):
            return name, bytes(text)


def _of_texts(before: tuple[str, bytes], after: tuple[str, bytes]) -> Difference:
    """Compare two UMRF files, each given as name and text. Actions are matched by name, since files
    have no other identity."""
    return difference((0, by_name(_graph(*before))), (0, by_name(_graph(*after))))


def _graph(name: str, text: bytes) -> Graph:
    try:
        return codec.read(text).graph
    except codec.Unreadable as error:
        raise CannotStart(refusal(name, error)) from error
